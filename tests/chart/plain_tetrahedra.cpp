#include <algorithm>

#include "tests/chart/baselines.h"
#include "tests/chart/fast_model.h"

namespace sectio::chart {
namespace {

class PlainTetrahedra final : public FastModel {
 public:
  PlainTetrahedra(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings)
      : FastModel(mesh, material, settings), batches_(batches_of<TetBatch>(mesh, all_in_order(mesh))) {
    divide_step();
    x_.assign(particles() + 4, Vec4f::Zero());
    force_ = x_;
  }

  void step(std::span<Vec4f> position, std::span<Vec4f> velocity, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    divided_.begin(constraints, position, parts_);
    const double part_s = settings_.step_s / parts_;
    for (int part = 0; part < parts_; ++part) {
      move(static_cast<float>(part_s), position, velocity);
      if (!constraints.empty()) divided_.project_substep(part, part_s, inverse_mass_, position, velocity);
    }
    divided_.finish(reactions);
  }

 private:
  void move(float h, std::span<Vec4f> position, std::span<Vec4f> velocity) {
    std::copy(position.begin(), position.end(), x_.begin());
    forces(x_, force_);
    const float kept = 1 - static_cast<float>(material_.damping_per_s) * h;
    Vec4f falls = Vec4f::Zero();
    falls.head<3>() = h * settings_.gravity_m_per_s2.cast<float>();
    for (std::size_t i = 0; i < particles(); ++i) {
      if (inverse_mass_[i] == 0) continue;
      velocity[i] = kept * velocity[i] + h * static_cast<float>(inverse_mass_[i]) * force_[i] + falls;
      position[i] += h * velocity[i];
    }
  }

  void forces(std::span<const Vec4f> x, std::span<Vec4f> force) const override {
    std::fill(force.begin(), force.end(), Vec4f::Zero());
    tet_loops16().neo_hookean(batches_.data(), batches_.size(), tissue_, bytes(x), bytes(force));
  }

  // Equal parts of the step, each 0.6 of the limit at rest, which power iteration finds.
  void divide_step() {
    const double by_m = 1e-3 * std::cbrt(6 * tet_volume_m3(mesh_, mesh_.tetrahedra.front()));
    std::vector<Vec3> u(particles());
    std::vector<Vec4f> rest, at, f(particles() + 4);
    for (const Vec3& p : mesh_.vertices_body_m) rest.emplace_back(p.x(), p.y(), p.z(), 0);
    rest = with_unused(rest);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = inverse_mass_[i] > 0 ? fixed_vector(i) : Vec3::Zero();
    double omega2 = 0;
    for (int n = 0; n < 100; ++n) {
      double largest = 0, up = 0, down = 0;
      for (const Vec3& d : u) largest = std::max(largest, d.cwiseAbs().maxCoeff());
      at = rest;
      for (std::size_t i = 0; i < u.size(); ++i) at[i].head<3>() += (by_m / largest * u[i]).cast<float>();
      forces(at, f);
      for (std::size_t i = 0; i < u.size(); ++i) {
        if (inverse_mass_[i] == 0) continue;
        const Vec3 next = -inverse_mass_[i] / by_m * f[i].head<3>().cast<double>(), now = u[i] / largest;
        up += now.dot(next) / inverse_mass_[i], down += now.squaredNorm() / inverse_mass_[i];
        u[i] = next;
      }
      omega2 = up / down;
    }
    parts_ = static_cast<int>(std::ceil(settings_.step_s * std::sqrt(omega2) / (2 * 0.6)));
  }

  std::vector<TetBatch> batches_;
  std::vector<Vec4f> x_, force_;
  DividedConstraints divided_;
  int parts_ = 1;
};

}  // namespace

ChartModel plain_tetrahedra(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings) {
  return with_forces(std::make_unique<PlainTetrahedra>(mesh, material, settings));
}

}  // namespace sectio::chart
