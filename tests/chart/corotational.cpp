#include <algorithm>

#include "tests/chart/baselines.h"
#include "tests/chart/fast_model.h"

namespace sectio::chart {
namespace {

// f = - sum_e R K (R^T x - X),  K_ab = V [lambda g_a g_b^T + mu (g_b g_a^T + (g_a . g_b) 1)]
// (m (1 + alpha h) + h^2 K') v = m v0 + h (f + m g) by conjugate gradients, from v = v0;  K' = R K R^T, element by
// element: a product takes less time than it takes to write rows of blocks for it.
class Corotational final : public FastModel {
 public:
  Corotational(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations)
      : FastModel(mesh, material, settings),
        iterations_(iterations),
        batches_(batches_of<CorotatedBatch>(mesh, all_in_order(mesh))) {
    for (CorotatedBatch& b : batches_) std::fill(b.rotation[0], b.rotation[0] + kBatch, 1.0f);
    for (auto* v :
         {&x_, &force_, &velocity_, &residual_, &direction_, &product_, &solved_, &diagonal_[0], &diagonal_[1]})
      v->assign(particles() + 4, Vec4f::Zero());
    inverse_block_.resize(particles());
  }

  void step(std::span<Vec4f> position, std::span<Vec4f> velocity, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    std::fill(reactions.begin(), reactions.end(), Reaction{});
    const auto h = static_cast<float>(settings_.step_s);
    std::copy(position.begin(), position.end(), x_.begin());
    std::copy(velocity.begin(), velocity.end(), velocity_.begin());
    hold(constraints, h);
    linearise();
    begin(h);
    conjugate_gradients(h * h);
    for (std::size_t i = 0; i < particles(); ++i) {
      if (free_[i]) x_[i] += h * velocity_[i];
      position[i] = x_[i];
      velocity[i] = velocity_[i];
    }
    for (const PointConstraint& c : constraints)
      if (!c.unilateral) position[c.v[0]].head<3>() = c.target_world_m.cast<float>();
  }

 private:
  static constexpr int kPolar = 2;         // Newton steps of rotations that are warm
  static constexpr float kEnough = 1e-3f;  // share of the largest residual at the start of a step so far
  static constexpr float kBeyond_m = 1e-7f;

  // Vertices that are beyond their plane, and are not pulled away from it, are put onto it and held for the step;
  // dragged ones go where they are dragged to.
  void hold(std::span<const PointConstraint> constraints, float h) {
    free_.assign(particles(), 0);
    for (std::size_t i = 0; i < particles(); ++i) free_[i] = inverse_mass_[i] > 0;
    for (std::size_t i = 0; i < particles(); ++i)
      if (!free_[i]) velocity_[i].setZero();
    for (const PointConstraint& c : constraints) {
      const VertexId v = c.v[0];
      auto x = x_[v].head<3>();
      const Vec3f from_target = x - c.target_world_m.cast<float>(), normal = c.normal.cast<float>();
      velocity_[v].setZero();
      if (!c.unilateral) {
        velocity_[v].head<3>() = -from_target / h;
        free_[v] = 0;
        continue;
      }
      const float beyond = from_target.dot(normal);
      if (beyond < -kBeyond_m || force_[v].head<3>().dot(normal) < 0) continue;
      x -= beyond * normal;
      free_[v] = 0;
    }
  }

  void linearise() {
    for (auto* v : {&force_, &diagonal_[0], &diagonal_[1]}) std::fill(v->begin(), v->end(), Vec4f::Zero());
    char* const diagonal[2] = {bytes(diagonal_[0]), bytes(diagonal_[1])};
    tet_loops16().corotate(batches_.data(), batches_.size(), tissue_, kPolar, bytes(std::span<const Vec4f>(x_)),
                           bytes(force_), diagonal);
  }

  // The residual b - A v at the start, and the inverse blocks.
  void begin(float h) {
    std::fill(product_.begin(), product_.end(), Vec4f::Zero());
    multiply(velocity_, product_);
    const Vec3f gravity = settings_.gravity_m_per_s2.cast<float>();
    const float damping = static_cast<float>(material_.damping_per_s) * h;
    scaled_mass_.resize(particles());
    for (std::size_t i = 0; i < particles(); ++i) {
      const auto m = static_cast<float>(mass_[i]);
      scaled_mass_[i] = m * (1 + damping);
      residual_[i].setZero();
      inverse_block_[i].setZero();
      if (!free_[i]) continue;
      residual_[i].head<3>() = h * (force_[i].head<3>() + m * gravity) - m * damping * velocity_[i].head<3>() -
                               h * h * product_[i].head<3>();
      const Vec4f &d = diagonal_[0][i], &o = diagonal_[1][i];
      Eigen::Matrix3f block;
      block << d.x(), o.x(), o.z(), o.x(), d.y(), o.y(), o.z(), o.y(), d.z();
      block = h * h * block + scaled_mass_[i] * Eigen::Matrix3f::Identity();
      inverse_block_[i].leftCols<3>().topRows<3>() = block.inverse();
    }
  }

  void multiply(std::span<const Vec4f> in, std::span<Vec4f> out) const {
    tet_loops16().multiply(batches_.data(), batches_.size(), tissue_, bytes(in), bytes(out));
  }
  float precondition() {
    float rho = 0;
    for (std::size_t i = 0; i < particles(); ++i) {
      solved_[i].noalias() = inverse_block_[i] * residual_[i];
      rho += solved_[i].dot(residual_[i]);
    }
    return rho;
  }
  void conjugate_gradients(float h2) {
    float rho = precondition();
    direction_ = solved_;
    largest_rho_ = std::max(largest_rho_, rho);
    const float enough = kEnough * kEnough * largest_rho_;
    for (int n = 0; n < iterations_ && (n == 0 || rho > enough) && rho > 0; ++n) {
      std::fill(product_.begin(), product_.end(), Vec4f::Zero());
      multiply(direction_, product_);
      float curvature = 0;
      for (std::size_t i = 0; i < particles(); ++i) {
        product_[i] = h2 * product_[i] + scaled_mass_[i] * direction_[i];
        curvature += product_[i].dot(direction_[i]);
      }
      const float along = rho / curvature;
      for (std::size_t i = 0; i < particles(); ++i) {
        velocity_[i] += along * direction_[i];
        residual_[i] -= along * product_[i];
      }
      const float next = precondition();
      for (std::size_t i = 0; i < particles(); ++i) direction_[i] = solved_[i] + next / rho * direction_[i];
      rho = next;
    }
  }

  void forces(std::span<const Vec4f> x, std::span<Vec4f> force) const override {
    std::fill(force.begin(), force.end(), Vec4f::Zero());
    std::vector<CorotatedBatch> batches = batches_;
    tet_loops16().corotate(batches.data(), batches.size(), tissue_, 2 * kPolar, bytes(x), bytes(force), nullptr);
  }

  int iterations_;
  float largest_rho_ = 0;
  std::vector<CorotatedBatch> batches_;
  std::vector<std::uint8_t> free_;
  std::vector<Vec4f> x_, force_, velocity_, residual_, direction_, product_, solved_;
  std::array<std::vector<Vec4f>, 2> diagonal_;
  std::vector<float> scaled_mass_;
  std::vector<Eigen::Matrix4f> inverse_block_;
};

}  // namespace

ChartModel corotational(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings,
                        int iterations) {
  return with_forces(std::make_unique<Corotational>(mesh, material, settings, iterations));
}

}  // namespace sectio::chart
