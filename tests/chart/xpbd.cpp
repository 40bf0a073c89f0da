#include <algorithm>

#include "tests/chart/baselines.h"
#include "tests/chart/fast_model.h"

namespace sectio::chart {
namespace {

// The tetrahedra by colours, of which no two of a colour share a vertex; each colour begins a batch.
std::vector<std::uint32_t> by_colour(const TetMesh& mesh) {
  std::vector<std::uint64_t> taken(mesh.vertices_body_m.size(), 0);
  std::vector<std::vector<std::uint32_t>> colours;
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    std::uint64_t near = 0;
    for (const VertexId v : mesh.tetrahedra[t]) near |= taken[v];
    const auto colour = static_cast<std::size_t>(std::countr_one(near));
    if (colour >= 64) throw InputError("more than 64 colours");
    for (const VertexId v : mesh.tetrahedra[t]) taken[v] |= std::uint64_t{1} << colour;
    if (colour >= colours.size()) colours.resize(colour + 1);
    colours[colour].push_back(t);
  }
  std::vector<std::uint32_t> order;
  for (const auto& colour : colours) {
    order.insert(order.end(), colour.begin(), colour.end());
    while (order.size() % kBatch != 0) order.push_back(kNone);
  }
  return order;
}

// C_shape = |F|, compliance 1 / (mu V);  C_volume = det F - 1 - mu / kappa, compliance 1 / (kappa V), kappa = lambda +
// mu: the energies C^2 / (2 compliance) add up to the stable neo-Hookean one.
class Xpbd final : public FastModel {
 public:
  Xpbd(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations)
      : FastModel(mesh, material, settings),
        iterations_(iterations),
        batches_(batches_of<XpbdBatch>(mesh, by_colour(mesh))),
        plain_(batches_of<TetBatch>(mesh, all_in_order(mesh))) {
    for (XpbdBatch& b : batches_)
      for (std::size_t i = 0; i < kBatch; ++i) {
        const float volume = b.volume_m3[i] > 0 ? b.volume_m3[i] : 1;
        b.compliance[0][i] = 1 / (tissue_.mu_pa * volume);
        b.compliance[1][i] = 1 / ((tissue_.lambda_pa + tissue_.mu_pa) * volume);
      }
  }

  void step(std::span<Vec4f> position, std::span<Vec4f> velocity, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    std::fill(reactions.begin(), reactions.end(), Reaction{});
    const auto h = static_cast<float>(settings_.step_s);
    const float kept = h * static_cast<float>(1 / (1 + material_.damping_per_s * settings_.step_s));
    const Vec4f falls = h * kept * gravity();
    x_ = with_unused(position);
    for (std::size_t i = 0; i < particles(); ++i) {
      if (inverse_mass_[i] > 0) x_[i] += kept * velocity[i] + falls;
      x_[i][3] = static_cast<float>(inverse_mass_[i]);
    }
    for (const PointConstraint& c : constraints)
      if (!c.unilateral) x_[c.v[0]] << c.target_world_m.cast<float>(), 0;
    for (XpbdBatch& b : batches_) std::fill(&b.multiplier[0][0], &b.multiplier[0][0] + 2 * kBatch, 0.0f);
    for (int n = 0; n < iterations_; ++n) {
      tet_loops16().solve_constraints(batches_.data(), batches_.size(), tissue_, h, bytes(x_));
      for (const PointConstraint& c : constraints) {
        if (!c.unilateral) continue;
        auto x = x_[c.v[0]].head<3>();
        const Vec3f normal = c.normal.cast<float>();
        x -= std::max(0.0f, (x - c.target_world_m.cast<float>()).dot(normal)) * normal;
      }
    }
    for (std::size_t i = 0; i < particles(); ++i) {
      x_[i][3] = 0;
      velocity[i] = (x_[i] - position[i]) / h;
      position[i] = x_[i];
    }
  }

 private:
  Vec4f gravity() const {
    Vec4f g = Vec4f::Zero();
    g.head<3>() = settings_.gravity_m_per_s2.cast<float>();
    return g;
  }
  void forces(std::span<const Vec4f> x, std::span<Vec4f> force) const override {
    std::fill(force.begin(), force.end(), Vec4f::Zero());
    tet_loops16().neo_hookean(plain_.data(), plain_.size(), tissue_, bytes(x), bytes(force));
  }

  int iterations_;
  std::vector<XpbdBatch> batches_;
  std::vector<TetBatch> plain_;
  std::vector<Vec4f> x_;
};

}  // namespace

ChartModel xpbd(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations) {
  return with_forces(std::make_unique<Xpbd>(mesh, material, settings, iterations));
}

}  // namespace sectio::chart
