#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "common/core/hand_silence.h"
#include "device_bridge/device/scripted_device.h"
#include "device_bridge/device/virtual_hand.h"
#include "device_bridge/device/wish_hand.h"

namespace sectio::servo_test {
namespace {

// One stroke, as devices of different kinds would record it.
Pose stroke(double t) {
  const double s = std::clamp(t, 0.0, 1.0);
  const double way = s * s * s * (10 + s * (6 * s - 15));  // minimum jerk
  const Vec3 tip(0.05 * way, 0.01 * std::sin(std::numbers::pi * way), 0.02 - 0.03 * way);
  return {tip, Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * way, Vec3::UnitY()))};
}

std::vector<TracePoint> recorded(double rate_hz, double resolution_m) {
  std::vector<TracePoint> trace;
  for (int i = 0; i <= static_cast<int>(rate_hz); ++i) {
    Pose pose = stroke(i / rate_hz);
    if (resolution_m > 0) {
      for (double& x : pose.position_m) x = std::round(x / resolution_m) * resolution_m;
    }
    trace.push_back({i / rate_hz, pose});
  }
  return trace;
}

// The bridge's part of the row: whatever was recorded, the server gets the same stream of poses at the servo's rate,
// within the device's own resolution and what passes between two of its samples.
TEST(B_IN, B_IN_1_haptic_device_joystick_and_mouse_give_the_same_path) {
  struct Kind {
    const char* name;
    double rate_hz;
    double resolution_m;
    double tolerance_m;
  };
  for (const Kind& kind :
       {Kind{"haptic device", 1000, 0, 1e-6}, Kind{"joystick", 120, 0, 3e-5}, Kind{"mouse", 60, 1e-4, 2.5e-4}}) {
    ScriptedDevice device(recorded(kind.rate_hz, kind.resolution_m));
    double worst_m = 0;
    double worst_rad = 0;
    int samples = 0;
    for (; !device.finished(samples * 0.001); ++samples) {
      const Pose pose = device.pose_world(samples * 0.001);
      const Pose ideal = stroke(samples * 0.001);
      worst_m = std::max(worst_m, (pose.position_m - ideal.position_m).norm());
      worst_rad = std::max(worst_rad, pose.orientation.angularDistance(ideal.orientation));
    }
    EXPECT_EQ(samples, 1001) << kind.name;
    EXPECT_LT(worst_m, kind.tolerance_m) << kind.name;
    EXPECT_LT(worst_rad, 1e-3) << kind.name;
  }
}

TEST(ScriptedDevice, forces_dont_move_it) {
  ScriptedDevice device(recorded(100, 0));
  device.apply(Vec3(0, 0, 100));
  EXPECT_TRUE(device.pose_world(0.5).position_m.isApprox(stroke(0.5).position_m, 1e-9));
}

VirtualHand resting(const HandSpec& spec) {
  return VirtualHand({{0, Pose{}}, {10, Pose{}}}, spec);
}

TEST(VirtualHand, follows_its_wish) {
  VirtualHand hand(recorded(1000, 0), {.tremor_m = 0});
  for (int i = 0; i <= 1000; ++i) hand.pose_world(i * 0.001);
  EXPECT_LT((hand.pose_world(1.2).position_m - stroke(1).position_m).norm(), 1e-3);
}

TEST(VirtualHand, forces_move_it_by_hookes_law) {
  VirtualHand hand = resting({.hand_stiffness_n_per_m = 400, .tremor_m = 0});
  hand.apply(Vec3(0, 0, 2));
  EXPECT_NEAR(hand.pose_world(3).position_m.z(), 2.0 / 400, 1e-6);
  hand.apply(Vec3::Zero());
  EXPECT_NEAR(hand.pose_world(6).position_m.z(), 0, 1e-6);
}

TEST(VirtualHand, trembles_between8_and12_hz_by_a_tenth_of_a_millimetre) {
  VirtualHand hand = resting({.device_mass_kg = 1e-4, .device_damping_n_s_per_m = 0});  // so light that it shows all
  double squares = 0;
  int crossings = 0;
  double last = 0;
  for (int i = 1; i <= 8000; ++i) {
    const double x = hand.pose_world(i * 0.001).position_m.x();
    squares += x * x;
    crossings += (x > 0) != (last > 0);
    last = x;
  }
  EXPECT_NEAR(std::sqrt(squares / 8000), 1e-4, 3e-5);
  EXPECT_GT(crossings, 8 * 2 * 8 - 8);
  EXPECT_LT(crossings, 8 * 2 * 12 + 8);
}

TEST(VirtualHand, same_seed_same_motion_whatever_the_call_rate) {
  VirtualHand often = resting({});
  VirtualHand seldom = resting({});
  VirtualHand other = resting({.seed = 2});
  for (int i = 0; i < 500; ++i) often.pose_world(i * 0.001);
  EXPECT_EQ(often.pose_world(0.5).position_m, seldom.pose_world(0.5).position_m);
  EXPECT_NE(often.pose_world(0.5).position_m, other.pose_world(0.5).position_m);
}

// Wishes of somebody with a mouse.
class Mouse : public WishSource {
 public:
  void wish(const Vec3& place_m, bool held = true) { wish_ = HandWish{{Pose{place_m}, 0.1}, held}; }
  bool latest_wish(HandWish& wish) override {
    if (!wish_) return false;
    wish = *wish_;
    wish_.reset();
    return true;
  }

 private:
  std::optional<HandWish> wish_;
};

struct WishHandTest : testing::Test {
  Mouse mouse;
  WishHand hand;
  double now_s = 0;

  explicit WishHandTest(const HandSpec& spec = hand_without_swing()) : hand(mouse, 5, spec) {}

  // The fastest motion between two ticks.
  double run(double time_s) {
    double fastest_m_per_s = 0;
    for (const double end_s = now_s + time_s; now_s < end_s;) {
      const Vec3 before_m = hand.pose_world(now_s).position_m;
      now_s += 0.001;
      const Vec3 after_m = hand.pose_world(now_s).position_m;
      if (hand.present()) fastest_m_per_s = std::max(fastest_m_per_s, (after_m - before_m).norm() / 0.001);
    }
    return fastest_m_per_s;
  }
};

struct TrackerHandTest : WishHandTest {
  TrackerHandTest() : WishHandTest(hand_without_lag()) {}
};

TEST_F(WishHandTest, appears_where_it_is_wanted_and_follows) {
  run(0.1);
  EXPECT_FALSE(hand.present());
  mouse.wish(Vec3(0.1, 0, 0));
  run(0.01);
  EXPECT_TRUE(hand.present());
  EXPECT_NEAR((hand.pose_world(now_s).position_m - Vec3(0.1, 0, 0)).norm(), 0, 1e-9);
  mouse.wish(Vec3(0.11, 0, 0));
  run(0.5);
  EXPECT_NEAR((hand.pose_world(now_s).position_m - Vec3(0.11, 0, 0)).norm(), 0, 1e-5);
}

TEST_F(WishHandTest, follows_a_wish_of100_metres_per_second_at_the_speed_of_hands) {
  mouse.wish(Vec3::Zero());
  run(0.01);
  mouse.wish(Vec3(3, 0, 0));
  EXPECT_LE(run(0.4), 5.001);
  EXPECT_NEAR(hand.pose_world(now_s).position_m.x(), 5 * 0.4, 0.2);
}

// A press beside the last cut stabbed four times as deep as it was meant.
TEST_F(WishHandTest, stops_where_it_is_wanted) {
  mouse.wish(Vec3::Zero());
  run(0.01);
  double from_m = 0;
  for (const double to_m : {0.005, 0.1, 0.3, 0.02}) {
    mouse.wish(Vec3(to_m, 0, 0));
    double past_m = 0;
    for (int i = 0; i < 500; ++i) {
      run(0.001);
      past_m = std::max(past_m, (hand.pose_world(now_s).position_m.x() - to_m) * (to_m > from_m ? 1 : -1));
    }
    EXPECT_LT(past_m, 1e-6) << "from " << from_m << " to " << to_m;
    EXPECT_NEAR(hand.pose_world(now_s).position_m.x(), to_m, 1e-4);
    from_m = to_m;
  }
}

TEST_F(WishHandTest, goes_straight_out_when_it_is_let_go_in_motion) {
  mouse.wish(Vec3::Zero());
  run(0.01);
  for (int i = 1; i <= 200; ++i) {
    mouse.wish(Vec3(0.0005 * i, 0, 0));
    run(0.001);
  }
  const double there_m = hand.pose_world(now_s).position_m.x();
  mouse.wish(Vec3::Zero(), false);
  double aside_m = 0;
  while (hand.present()) {
    run(0.001);
    aside_m = std::max(aside_m, hand.pose_world(now_s).position_m.x() - there_m);
  }
  EXPECT_LT(aside_m, 0.004) << "0.5 m/s, and half of its damping's time constant";
}

// A position that came later than its orientation would put the tip elsewhere.
TEST_F(TrackerHandTest, follows_without_a_lag_and_hardly_swings) {
  mouse.wish(Vec3::Zero());
  run(0.01);
  for (int i = 1; i <= 500; ++i) {
    mouse.wish(Vec3(0.0003 * i, 0, 0));
    run(0.001);
    ASSERT_TRUE(i < 100 || std::abs(hand.pose_world(now_s).position_m.x() - 0.0003 * i) < 1e-3) << i << " ms";
  }
  run(0.5);
  mouse.wish(Vec3(0.16, 0, 0));
  double past_m = 0;
  for (int i = 0; i < 300; ++i) {
    run(0.001);
    past_m = std::max(past_m, hand.pose_world(now_s).position_m.x() - 0.16);
  }
  EXPECT_LT(past_m, 0.2 * 0.01);
}

TEST_F(WishHandTest, lends_a_force_no_damping_that_it_has_not) {
  EXPECT_NEAR(hand.limits().damping_n_s_per_m + kHandDamping_n_s_per_m, 13.4, 0.1);
  EXPECT_NEAR(limits_of(HandSpec{}).damping_n_s_per_m, 0.5, 1e-12);
}

TEST_F(WishHandTest, gives_way_to_a_force) {
  mouse.wish(Vec3::Zero());
  run(0.01);
  hand.apply(Vec3(0, 0, 2.25));
  run(0.5);
  EXPECT_NEAR(hand.pose_world(now_s).position_m.z(), 2.25 / HandSpec{}.hand_stiffness_n_per_m, 1e-4);
}

TEST_F(WishHandTest, draws_the_instrument_out_when_it_is_let_go_or_the_hand_is_silent) {
  for (const bool says_so : {true, false}) {
    mouse.wish(Vec3(0.1, 0, 0));
    run(0.01);
    if (says_so) mouse.wish(Vec3::Zero(), false);
    run(says_so ? 0.3 : kWishSilence_s + 0.3);
    EXPECT_TRUE(hand.present());
    EXPECT_GT(hand.pose_world(now_s).position_m.z(), 0.05) << "along its shaft";
    EXPECT_GT(hand.opening_rad(now_s), 0.5) << "with open jaws";
    run(0.4);
    EXPECT_FALSE(hand.present());
  }
}

// Somebody else takes it over, at another place: it is drawn out, and appears there.
TEST_F(WishHandTest, never_goes_through_tissue_from_one_hand_to_the_next) {
  mouse.wish(Vec3::Zero());
  run(0.01);
  mouse.wish(Vec3::Zero(), false);
  run(0.01);
  for (int i = 0; i < 60; ++i) {
    mouse.wish(Vec3(0.2, 0, 0));
    EXPECT_LT(run(0.016), 1) << i;
  }
  EXPECT_TRUE(hand.present());
  EXPECT_NEAR((hand.pose_world(now_s).position_m - Vec3(0.2, 0, 0)).norm(), 0, 1e-6);
}

}  // namespace
}  // namespace sectio::servo_test
