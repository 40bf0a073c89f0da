// The pressure inside a free piece: how it changes velocities, and what it must not change.
#include "sim_server/deformation/inside_pressure.h"

#include <gtest/gtest.h>

#include <utility>

#include "common/mesh/check.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::deformation_test {
namespace {

class Squeezed {
 public:
  explicit Squeezed(double by)
      : mesh_(test::ellipsoid({0.012, 0.010, 0.006}, 2)), frames_(Pose{}), mass_kg_(mesh_.vertex_slots()) {
    for (VertexId v = 0; v < mesh_.vertex_slots(); ++v) {
      all_.push_back(v);
      x_.emplace_back(Vec4f::Zero());
      x_.back().head<3>() = (by * mesh_.rest_body_m(v) + Vec3(0.1, -0.2, 0.05)).cast<float>();
      mass_kg_[v] = 1e-5 * (1 + v % 7);
      inverse_mass_per_kg_.push_back(1 / mass_kg_[v]);
    }
    v_.assign(x_.size(), Vec4f::Zero());
    frames_.resize(mesh_.vertex_slots());
    for (const VertexId v : all_) frames_.move(v, 0);
    set_free(true);
  }

  void set_free(bool free) { frames_.set(0, all_, free); }
  void push(double step_s) { pressure_.push(mesh_, frames_, step_s, inverse_mass_per_kg_, x_, v_); }
  void step(double step_s) {
    push(step_s);
    for (std::size_t v = 0; v < x_.size(); ++v) x_[v] += static_cast<float>(step_s) * v_[v];
  }
  double volume_share() const {
    std::vector<Vec3> at;
    for (const Vec4f& x : x_) at.push_back(x.head<3>().cast<double>());
    return check(mesh_, at).volume_m3 / check(mesh_).volume_m3;
  }
  double energy_j() const {
    double energy = pressure_.energy_j(mesh_, frames_, x_);
    for (std::size_t v = 0; v < v_.size(); ++v)
      energy += 0.5 * mass_kg_[v] * v_[v].head<3>().cast<double>().squaredNorm();
    return energy;
  }
  // Linear and angular momentum, each relative to the sum of what the vertices have.
  std::pair<double, double> momenta() const {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double linear_sum = 0, angular_sum = 0;
    const Vec3 middle(0.1, -0.2, 0.05);
    for (std::size_t v = 0; v < v_.size(); ++v) {
      const Vec3 mv = mass_kg_[v] * v_[v].head<3>().cast<double>(), arm = x_[v].head<3>().cast<double>() - middle;
      linear += mv;
      angular += arm.cross(mv);
      linear_sum += mv.norm();
      angular_sum += arm.norm() * mv.norm();
    }
    return {linear.norm() / linear_sum, angular.norm() / angular_sum};
  }
  float fastest_m_per_s() const {
    float most = 0;
    for (const Vec4f& v : v_) most = std::max(most, v.head<3>().norm());
    return most;
  }

 private:
  TriangleMesh mesh_;
  RestFrames frames_;
  InsidePressure pressure_{ElasticMaterial{8000, 0.45, 1050}};
  std::vector<VertexId> all_;
  std::vector<Vec4f> x_, v_;
  std::vector<double> mass_kg_, inverse_mass_per_kg_;
};

TEST(InsidePressure, opens_what_is_squeezed_and_pushes_and_turns_nothing_as_a_whole) {
  for (const double by : {0.8, 0.97, 1.1}) {
    Squeezed piece(by);
    const double before = piece.volume_share();
    piece.step(0.0005);
    EXPECT_LT(std::abs(piece.volume_share() - 1), std::abs(before - 1)) << by;
    const auto [linear, angular] = piece.momenta();
    EXPECT_LT(linear, 1e-5) << by;
    EXPECT_LT(angular, 1e-5) << by;
  }
}

TEST(InsidePressure, gives_no_energy_at_any_step) {
  for (const double step_s : {1e-4, 1e-3, 1.0 / 30}) {
    Squeezed piece(0.95);
    double before = piece.energy_j();
    for (int n = 0; n < 200; ++n) {
      piece.step(step_s);
      const double after = piece.energy_j();
      EXPECT_LT(after, 1.001 * before) << step_s << " s, step " << n;
      before = after;
    }
    EXPECT_NEAR(piece.volume_share(), 1, 0.15) << step_s;
  }
}

TEST(InsidePressure, acts_on_free_pieces_alone_and_on_those_that_have_become_free) {
  Squeezed piece(0.9);
  piece.set_free(false);
  piece.push(0.001);
  EXPECT_EQ(piece.fastest_m_per_s(), 0);
  EXPECT_EQ(piece.energy_j(), 0);
}

TEST(InsidePressure, leaves_what_has_its_volume_alone) {
  Squeezed piece(1);
  piece.push(0.001);
  EXPECT_LT(piece.fastest_m_per_s(), 1e-4F);
}

}  // namespace
}  // namespace sectio::deformation_test
