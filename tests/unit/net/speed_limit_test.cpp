#include "sim_server/net/speed_limit.h"

#include <gtest/gtest.h>

namespace sectio::net_test {
namespace {

ToolSample at(double x_m, double turn_rad = 0, std::uint64_t source = 7) {
  ToolSample sample;
  sample.source = source;
  sample.pose_world = {Vec3(x_m, 0, 0), Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vec3::UnitZ()))};
  return sample;
}

TEST(SpeedLimit, leaves_a_hand_as_it_is_and_follows_a_jump_at_the_limit) {
  SpeedLimit limit(5);
  double now_s = 100;
  for (int i = 0; i < 1000; ++i, now_s += 0.001)
    EXPECT_EQ(limit.follow(at(0.002 * i), now_s).position_m.x(), 0.002 * i);
  double last_m = 0.002 * 999;
  for (int i = 0; i < 100; ++i, now_s += 0.001) {
    const double x_m = limit.follow(at(1000), now_s).position_m.x();
    EXPECT_LE(x_m - last_m, 0.0051 + (i == 0 ? 5 * SpeedLimit::kSaved_s : 0));
    EXPECT_GT(x_m, last_m);
    last_m = x_m;
  }
  EXPECT_EQ(limit.follow(at(50, 0, 8), now_s).position_m.x(), 50) << "another hand appears where it is";
}

TEST(SpeedLimit, a_hand_that_was_late_is_followed_through_all_its_poses) {
  SpeedLimit limit(5);
  limit.follow(at(0), 1);
  double x_m = 0;
  for (int i = 1; i <= 20; ++i) x_m = limit.follow(at(0.0005 * i), 1.02).position_m.x();  // 20 ms at once
  EXPECT_NEAR(x_m, 0.01, 1e-12);
}

TEST(SpeedLimit, an_instrument_does_not_turn_about_in_one_step) {
  SpeedLimit limit(5);
  limit.follow(at(0), 1);
  const Pose pose = limit.follow(at(0, 3), 1.001);
  EXPECT_LE(pose.orientation.angularDistance(Eigen::Quaterniond::Identity()),
            SpeedLimit::kFastestTurn_rad_per_s * (SpeedLimit::kSaved_s + 0.001) + 1e-9);
}

}  // namespace
}  // namespace sectio::net_test
