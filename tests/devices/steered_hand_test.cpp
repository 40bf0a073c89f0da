// Hands that say where to go: steps become a wish, and tissue holds the instrument up.
#include <gtest/gtest.h>

#include <numbers>

#include "common/core/hand_silence.h"
#include "device_bridge/device/steered_hand.h"

namespace sectio {
namespace {

struct FakeSteering : Steering {
  explicit FakeSteering(std::optional<Step>& s) : per_second(s) {}
  std::optional<Step> step(double dt_s) override {
    if (!per_second) return std::nullopt;
    Step step = *per_second;
    step.way_m *= dt_s;
    step.turn_rad *= dt_s;
    return step;
  }
  std::optional<Step>& per_second;
};

struct SteeredHandTest : testing::Test {
  std::optional<Step> per_second = Step{};
  SteeredHand hand{
      std::make_unique<FakeSteering>(per_second), {.at_world_m = Vec3(0, 0, 0.1), .turn_rad = std::numbers::pi / 2}, 5};
  double now_s = 0;

  Pose run(double time_s) {
    Pose pose;
    for (const double end_s = now_s + time_s; now_s < end_s; now_s += 0.001) pose = hand.pose_world(now_s);
    return pose;
  }
};

TEST_F(SteeredHandTest, appears_where_it_is_told_and_goes_as_fast_as_it_is_pushed) {
  EXPECT_TRUE(run(0.01).position_m.isApprox(Vec3(0, 0, 0.1)));
  EXPECT_TRUE(hand.present());
  per_second->way_m = Vec3(0, 0.05, -0.02);
  run(1);
  per_second->way_m.setZero();
  EXPECT_NEAR((run(0.5).position_m - Vec3(-0.05, 0, 0.08)).norm(), 0, 1e-4);
}

TEST_F(SteeredHandTest, turns_about_its_own_axes_and_takes_small_steps_with_the_clutch) {
  per_second->turn_rad = Vec3(0, 0, -std::numbers::pi / 2);
  EXPECT_NEAR(run(1).orientation.angularDistance(Eigen::Quaterniond::Identity()), 0, 0.01);
  per_second = Step{.way_m = Vec3(0, 0, 0.1), .buttons = {.clutch = true, .grip = true}};
  run(1);
  per_second->way_m.setZero();
  EXPECT_NEAR(run(0.5).position_m.z(), 0.1 + SteeredHand::kSmallSteps * 0.1, 1e-4);
  EXPECT_NEAR(hand.opening_rad(now_s), 0, 1e-9);
  EXPECT_EQ(hand.buttons(), (Buttons{true, true}));
}

// A pad that goes on to push into what doesn't yield must not need as long to come back.
TEST_F(SteeredHandTest, the_wish_stays_near_an_instrument_that_is_held_up) {
  run(0.01);
  per_second->way_m = Vec3(0, 0, -0.5);
  for (int i = 0; i < 2000; ++i) {
    const Pose pose = hand.pose_world(now_s += 0.001);
    hand.apply(Vec3(0, 0, std::max(0.0, -20000 * (pose.position_m.z() - 0.09))));
  }
  EXPECT_GT(hand.pose_world(now_s).position_m.z(), 0.085);
  per_second->way_m = Vec3(0, 0, 0.5);
  hand.apply(Vec3::Zero());
  EXPECT_GT(run(0.2).position_m.z(), 0.1);
}

TEST_F(SteeredHandTest, a_pad_that_is_lost_lets_the_instrument_go_and_begins_anew_outside) {
  run(0.01);
  per_second->way_m = Vec3(0, 0, -0.05);
  run(1);
  per_second.reset();
  run(0.01);
  EXPECT_EQ(hand.status(), DeviceStatus::lost);
  run(kWishSilence_s + 1);
  EXPECT_FALSE(hand.present());
  per_second = Step{};
  EXPECT_TRUE(run(0.01).position_m.isApprox(Vec3(0, 0, 0.1)));
  EXPECT_TRUE(hand.present());
  EXPECT_EQ(hand.status(), DeviceStatus::ready);
}

}  // namespace
}  // namespace sectio
