#include <set>

#include "tests/chart/baselines.h"
#include "tests/chart/plain_model.h"

namespace sectio::chart {
namespace {

class PapersSprings final : public PlainModel {
 public:
  PapersSprings(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings)
      : PlainModel(mesh, material, settings) {
    double volume_m3 = 0;
    for (const TetShape& shape : shape_) volume_m3 += shape.volume_m3;
    std::fill(mass_.begin(), mass_.end(), volume_m3 * material.density_kg_per_m3 / static_cast<double>(mass_.size()));
    set_inverse_masses();
    std::vector<std::set<VertexId>> near(x_.size());
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (const VertexId a : t)
        for (const VertexId b : t)
          if (a != b) near[a].insert(b);
    std::array<std::set<std::pair<VertexId, VertexId>>, 2> pairs;
    for (VertexId a = 0; a < near.size(); ++a)
      for (const VertexId b : near[a]) {
        pairs[0].insert({std::min(a, b), std::max(a, b)});
        for (const VertexId c : near[b])
          if (c != a && !near[a].contains(c)) pairs[1].insert({std::min(a, c), std::max(a, c)});
      }
    for (const auto& kind : pairs) {
      double squares = 0;
      for (const auto& [a, b] : kind) squares += (x_[a] - x_[b]).squaredNorm();
      for (const auto& [a, b] : kind)
        if (x_[a] != x_[b])  // the two lips of a cut
          springs_.push_back({a, b, 3 * material.young_pa * volume_m3 / squares, (x_[a] - x_[b]).norm()});
    }
    divide_step();
  }

 private:
  void move(double step_s) override {
    forces(x_, force_);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (inverse_mass_[i] == 0) continue;
      v_[i] = (1 - material_.damping_per_s * step_s) * v_[i] +
              step_s * (inverse_mass_[i] * force_[i] + settings_.gravity_m_per_s2);
      x_[i] += step_s * v_[i];
    }
  }

  void forces(std::span<const Vec3> x, std::span<Vec3> force) const override {
    std::fill(force.begin(), force.end(), Vec3::Zero());
    for (const Spring& s : springs_) {
      const Vec3 d = x[s.b] - x[s.a];
      const Vec3 f = s.stiffness_n_per_m * (1 - s.rest_length_m / d.norm()) * d;
      force[s.a] += f;
      force[s.b] -= f;
    }
  }

  struct Spring {
    VertexId a, b;
    double stiffness_n_per_m, rest_length_m;
  };
  std::vector<Spring> springs_;
};

}  // namespace

ChartModel papers_springs(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings) {
  return with_forces(std::make_unique<PapersSprings>(mesh, material, settings));
}

}  // namespace sectio::chart
