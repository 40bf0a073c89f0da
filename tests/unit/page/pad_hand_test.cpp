#include "render_client/page/pad_hand.h"

#include <gtest/gtest.h>

namespace sectio::page_test {
namespace {

// Looks along the world's x axis, from above.
const Camera kCamera{Vec3(-0.3, 0, 0.3), Vec3::Zero(), Vec3::UnitZ(), 35};

struct Pad : testing::Test {
  PadHand hand;
  std::optional<JointPose> instrument;
  double now_s = 0;

  Vec3 run(double time_s, const PadState& state) {
    hand.push(state);
    for (const double end_s = now_s + time_s; now_s < end_s - 1e-9;) hand.tick(now_s += 0.01, instrument, kCamera);
    return hand.wish()->position_m;
  }
};

TEST_F(Pad, goes_where_a_person_at_the_camera_pushes_it) {
  const Vec3 first_m = run(0.01, {});
  EXPECT_TRUE(first_m.isApprox(Vec3(0, 0, 0.05)));
  EXPECT_TRUE((run(1, {.right = 1}) - first_m).isApprox(Vec3(0, -PadHand::kSpeed_m_per_s, 0), 1e-6));
  const Vec3 before_m = run(0.01, {});
  EXPECT_TRUE((run(1, {.away = 0.5, .up = -1, .slow = true}) - before_m)
                  .isApprox(PadHand::kSlow * PadHand::kSpeed_m_per_s * Vec3(0.5, 0, -1), 1e-6));
}

TEST_F(Pad, goes_on_from_where_the_instrument_is_and_stays_near_it) {
  instrument = JointPose{Pose{Vec3(0.1, 0, 0.02)}, 0.3};
  EXPECT_TRUE(run(0.01, {}).isApprox(Vec3(0.1, 0, 0.02)));
  EXPECT_NEAR(run(5, {.up = -1}).z(), 0.02 - PadHand::kLeash_m, 1e-9);
  EXPECT_LT(hand.wish()->opening_rad, PadHand::kWidest_rad + 1e-9);
  run(1, {.closes = true});
  EXPECT_NEAR(hand.wish()->opening_rad, 0, 1e-9);
}

}  // namespace
}  // namespace sectio::page_test
