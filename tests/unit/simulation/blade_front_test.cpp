// The front that holds a blade, and the tissue that blades have swept.
#include "sim_server/world/blade_front.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/shapes.h"

namespace sectio::simulation_test {
namespace {

constexpr double kToughness_j_per_m2 = 200, kTop_m = 0.03, kStep_m = 3e-4;

class BladeFrontTest : public testing::Test {
 protected:
  // An edge in a block of 60 x 60 x 30 mm goes along a path; `at(share)`: the edge. Returns the hand's work.
  double go(
      const std::function<EdgeAtRest(double)>& at, double length_m,
      const std::function<Vec3(double)>& sharp_side = [](double) { return Vec3(Vec3::UnitX()); }) {
    const int steps = static_cast<int>(std::ceil(length_m / kStep_m));
    double work_j = 0;
    most_n_ = steepest_n_ = 0, least_n_ = 1e9;
    for (int i = 0; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      const Vec3 before_n = blade_.force_n();
      blade_.begin_step(1e-3);
      blade_.move(tissue_, at(share), sharp_side(share), kToughness_j_per_m2);
      work_j += blade_.work_j();
      if (i > 0) steepest_n_ = std::max(steepest_n_, (blade_.force_n() - before_n).norm());
      if (share < 0.3) continue;
      most_n_ = std::max(most_n_, blade_.force_n().norm());
      least_n_ = std::min(least_n_, blade_.force_n().norm());
    }
    return work_j;
  }
  static EdgeAtRest upright(const Vec3& tip_m) { return {tip_m, tip_m + Vec3(0, 0, 0.04)}; }
  double straight(const Vec3& from, const Vec3& to) {
    return go([&](double s) { return upright(from + s * (to - from)); }, (to - from).norm());
  }

  TriangleMesh mesh_{test::box(6, 6, 3, Vec3(0.06, 0.06, kTop_m))};
  SweptTissue tissue_{mesh_};
  BladeFront blade_;
  double most_n_ = 0, least_n_ = 0, steepest_n_ = 0;
};

TEST_F(BladeFrontTest, work_is_toughness_times_area) {
  EXPECT_NEAR(straight(Vec3(0.01, 0.03, 0.02), Vec3(0.05, 0.03, 0.02)), 0.04 * 0.01 * 200, 0.03 * 0.08);
  EXPECT_NEAR(most_n_, 2, 0.02);
  EXPECT_NEAR(least_n_, 2, 0.02) << "steady";
  EXPECT_NEAR(blade_.new_area_m2(), (0.04 - 2 / BladeFront::kStiffest_n_per_m) * 0.01, 0.01 * 4e-4)
      << "behind the blade";
}

TEST_F(BladeFrontTest, an_own_slit_costs_nothing) {
  straight(Vec3(0.01, 0.03, 0.02), Vec3(0.04, 0.03, 0.02));
  const double back_j = straight(Vec3(0.04, 0.03, 0.02), Vec3(0.02, 0.03, 0.02));
  const double forth_j = straight(Vec3(0.02, 0.03, 0.02), Vec3(0.04, 0.03, 0.02));
  EXPECT_NEAR(back_j + forth_j, 0, 1e-4);
  straight(Vec3(0.04, 0.03, 0.02), Vec3(0.04, 0.03, 0.035));
  blade_.release();  // out of the tissue
  EXPECT_NEAR(straight(Vec3(0.03, 0.0302, 0.035), Vec3(0.03, 0.0302, 0.02)), 0, 1e-4);
  EXPECT_NEAR(straight(Vec3(0.03, 0.0302, 0.02), Vec3(0.05, 0.0302, 0.02)), 0.01 * 0.01 * 200, 2e-3) << "and goes on";
}

TEST_F(BladeFrontTest, a_curve_costs_its_area) {
  const double radius_m = 0.012, angle = 1.5 * std::numbers::pi;
  const auto at = [&](double s) {
    return upright(Vec3(0.03 + radius_m * std::sin(s * angle), 0.03 - radius_m * std::cos(s * angle), 0.02));
  };
  const double work_j =
      go(at, radius_m * angle, [&](double s) { return Vec3(std::cos(s * angle), std::sin(s * angle), 0); });
  EXPECT_NEAR(work_j, radius_m * angle * 0.01 * 200, 0.06 * radius_m * angle * 0.01 * 200);
}

TEST_F(BladeFrontTest, a_slice_pushes_less_and_costs_the_same) {
  // Along the edge twice as far as across it, in tissue on all of its length.
  const double work_j = go(
      [](double s) {
        return EdgeAtRest{Vec3(0.01 + 0.01 * s, 0.03, 0.002 + 0.02 * s), Vec3(0.01 + 0.01 * s, 0.03, 0.007 + 0.02 * s)};
      },
      std::hypot(0.01, 0.02));
  const double push_n = 0.005 * 200;
  EXPECT_NEAR(std::abs(blade_.force_n().x()), push_n / (1 + 4), 0.03 * push_n) << "Atkins: 1 / (1 + xi^2)";
  EXPECT_NEAR(std::abs(blade_.force_n().z()), 2 * push_n / (1 + 4), 0.03 * push_n);
  EXPECT_NEAR(work_j, 0.01 * 0.005 * 200, 0.05 * 0.01);
}

TEST_F(BladeFrontTest, a_blade_that_rests_keeps_its_force) {
  straight(Vec3(0.01, 0.03, 0.02), Vec3(0.03, 0.03, 0.02));
  const Vec3 force_n = blade_.force_n();
  for (int i = 0; i < 100; ++i)
    blade_.move(tissue_, upright(Vec3(0.03, 0.03, 0.02)), Vec3(Vec3::UnitX()), kToughness_j_per_m2);
  EXPECT_EQ(blade_.force_n(), force_n);
}

// A step is a millisecond. The hand trembles at 9 Hz along the cut, and otherwise across it.
TEST_F(BladeFrontTest, a_hand_that_trembles_is_not_jolted) {
  Vec3 at_m(0.01, 0.03, 0.02);
  for (const Vec3& amplitude_m : {Vec3(5e-4, 5e-4, 5e-4), Vec3(5e-4, 5e-4, 0), Vec3(3e-4, 3e-4, 3e-4)}) {
    straight(at_m, at_m + Vec3(0.008, 0, 0));
    at_m.x() += 0.008;
    constexpr double kTime_s = 3;
    const auto at = [&](double s) {
      const auto swings = [&](double hz) { return std::sin(2 * std::numbers::pi * hz * kTime_s * s); };
      return upright(at_m + amplitude_m.cwiseProduct(Vec3(swings(9), swings(7.3), swings(11.1))));
    };
    const double area_m2 = blade_.new_area_m2();
    const double work_j = go(at, 1000 * kTime_s * kStep_m);
    EXPECT_LE(steepest_n_, 0.3) << "of 2 N, across " << amplitude_m.transpose();
    EXPECT_GE(work_j, 0.9 * kToughness_j_per_m2 * (blade_.new_area_m2() - area_m2) - 1e-3);
    EXPECT_LE(work_j, 1.4 * kToughness_j_per_m2 * (blade_.new_area_m2() - area_m2) + 1e-3);
  }
}

TEST_F(BladeFrontTest, a_blade_out_of_the_tissue_feels_nothing) {
  straight(Vec3(-0.01, 0.03, 0.02), Vec3(-0.001, 0.03, 0.02));
  EXPECT_TRUE(blade_.force_n().isZero());
  straight(Vec3(-0.001, 0.03, 0.02), Vec3(0.07, 0.03, 0.02));
  EXPECT_TRUE(blade_.force_n().isZero()) << "through";
}

}  // namespace
}  // namespace sectio::simulation_test
