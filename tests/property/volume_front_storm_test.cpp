// Blades that follow their fronts through a body, at any speed, in curves, back and forth, two at once, in and out.
#include <gtest/gtest.h>

#include <random>

#include "common/delta/keyframe.h"
#include "common/mesh/check.h"
#include "tests/support/block_under_blade.h"
#include "tests/support/random.h"

namespace sectio {
namespace {

using test::BlockUnderBlade;

constexpr double kElement_m = 0.0065;

// A hand that is not steady.
class Hand {
 public:
  Hand(std::uint32_t tool, test::Random& random) : tool_(tool), random_(random) { begin(); }

  BladeMotion go(const BlockUnderBlade& block) {
    if (back_ == 0 && chance(0.03)) back_ = 5 + static_cast<int>(between(0, 25));
    const double step_m = between(0.02, 0.5) * kElement_m * (back_ > 0 ? -1 : 1);
    back_ = std::max(0, back_ - 1);
    yaw_ += between(-0.06, 0.06);
    tip_m_ += step_m * Vec3(std::cos(yaw_), std::sin(yaw_), between(-0.05, 0.05));
    up_ = (up_ + 0.02 * Vec3(between(-1, 1), between(-1, 1), 0)).normalized();
    const bool is_out = tip_m_.head<2>().norm() > 0.05, lift = is_out || chance(0.01);
    const BladeMotion motion = block.motion(tool_, tip_m_, up_, lift);
    return motion;
  }
  // It comes in anew, where its cut has ended.
  void look_at(const CutPlan& plan) {
    if (std::ranges::any_of(plan.outcomes, [&](const StrokeOutcome& o) { return o.edge_id == tool_; })) begin();
  }

 private:
  double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  bool chance(double p) { return between(0, 1) < p; }
  void begin() {
    const double from = between(0, 6.28);
    tip_m_ = {0.045 * std::cos(from), 0.045 * std::sin(from), between(0.006, 0.03)};
    yaw_ = from + 3.14159 + between(-0.5, 0.5);
    up_ = Vec3(between(-0.3, 0.3), between(-0.3, 0.3), 1).normalized();
    back_ = 0;
  }

  std::uint32_t tool_;
  test::Random& random_;
  Vec3 tip_m_ = Vec3::Zero(), up_ = Vec3::UnitZ();
  double yaw_ = 0;
  int back_ = 0;
};

struct Case {
  std::string model;
  unsigned seed;
};
class Fronts : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Storm, Fronts,
                         testing::Values(Case{"neo_hookean", 1}, Case{"neo_hookean", 2}, Case{"neo_hookean", 3},
                                         Case{"neo_hookean_lattice", 4}, Case{"tetra_springs", 5}),
                         [](const auto& c) { return c.param.model + "_" + std::to_string(c.param.seed); });

TEST_P(Fronts, C_CUT_3_body_replica_and_volume_stay_whole_and_plans_that_are_dropped_change_nothing) {
  test::Random random(GetParam().seed);
  BlockUnderBlade block(GetParam().model, 0, "progressive");
  auto replica = mesh_of(keyframe_of(block.body().mesh));
  ASSERT_TRUE(replica);
  const double volume_m3 = block.volume_m3();
  std::array hands{Hand(7, random), Hand(8, random)};
  int deltas = 0, dropped = 0;
  for (int n = 0; n < 500; ++n) {
    std::vector<BladeMotion> motions;
    for (Hand& hand : hands) motions.push_back(hand.go(block));
    if (n % 7 == 0) {
      const TetMesh before = block.cutting().volume().mesh();
      dropped += !block.plan(motions).delta.empty();
      const TetMesh after = block.cutting().volume().mesh();
      ASSERT_EQ(after.tetrahedra, before.tetrahedra) << n;
      ASSERT_EQ(after.vertices_body_m, before.vertices_body_m) << n;
    }
    const CutPlan plan = block.plan(motions);
    ASSERT_TRUE(block.body().apply(cut_as_planned(plan))) << n;
    for (Hand& hand : hands) hand.look_at(plan);
    block.body().deform({}, {}, 0.001);
    ASSERT_EQ(block.engine().first_bad_vertex(), kNone) << n;
    if (plan.delta.empty()) continue;
    ++deltas;
    ASSERT_EQ(apply(plan.delta, *replica), ApplyStatus::applied) << n;
    ASSERT_TRUE(replica->same_database(block.body().mesh)) << n;
    if (deltas % 5 != 0) continue;
    const SurfaceReport surface = check(*replica);
    ASSERT_TRUE(surface.valid()) << n << ": " << surface.first_defect;
    ASSERT_NEAR(surface.volume_m3, volume_m3, 1e-9 * volume_m3) << n;
    const TetReport inside = check(block.cutting().volume().mesh());
    ASSERT_TRUE(inside.conforming) << n << ": " << inside.first_defect;
    ASSERT_NEAR(inside.volume_m3, volume_m3, 1e-9 * volume_m3) << n;
  }
  EXPECT_GT(deltas, 80);
  EXPECT_GT(dropped, 10);
  std::printf("%d deltas, %zu tetrahedra, %.0f cm2 of walls, %.1f %% of mass added\n", deltas,
              block.cutting().volume().mesh().tetrahedra.size(), 1e4 * block.walls_m2(),
              100 * block.engine().diagnostics().added_mass_fraction);
}

}  // namespace
}  // namespace sectio
