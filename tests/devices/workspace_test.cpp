// From the room of a handle to the world, and back with the force.
#include <gtest/gtest.h>

#include <numbers>

#include "device_bridge/device/held_device.h"

namespace sectio {
namespace {

constexpr double kQuarter_rad = std::numbers::pi / 2;

Pose at(double x, double y, double z) {
  return Pose{Vec3(x, y, z)};
}

TEST(Workspace, begins_where_it_is_told_and_moves_as_the_handle_does) {
  WorkspaceMap map({.scale = 2, .at_world_m = Vec3(1, 2, 3), .turn_rad = kQuarter_rad});
  EXPECT_TRUE(map.to_world(at(0.1, 0.1, 0.1), false).position_m.isApprox(Vec3(1, 2, 3)));
  // Away from the person is against the world's x axis.
  EXPECT_TRUE(map.to_world(at(0.1, 0.2, 0.1), false).position_m.isApprox(Vec3(0.8, 2, 3)));
  EXPECT_TRUE(map.to_world(at(0.1, 0.2, 0.15), false).position_m.isApprox(Vec3(0.8, 2, 3.1)));
}

TEST(Workspace, gives_the_hand_the_force_in_its_own_axes) {
  WorkspaceMap map({.force_scale = 0.5, .turn_rad = kQuarter_rad});
  map.to_world(at(0, 0, 0), false);
  EXPECT_TRUE(map.to_hand(Vec3(-1, 0, 2)).isApprox(Vec3(0, 0.5, 1)));
}

TEST(Workspace, a_clutch_moves_the_handle_without_its_instrument) {
  WorkspaceMap map({});
  map.to_world(at(0, 0, 0), false);
  map.to_world(at(0.1, 0, 0), false);
  EXPECT_TRUE(map.to_world(at(0.1, 0, 0), true).position_m.isApprox(Vec3(0.1, 0, 0)));
  EXPECT_TRUE(map.to_hand(Vec3(0, 0, 1)).isZero());
  EXPECT_TRUE(map.to_world(at(-0.1, 0, 0), true).position_m.isApprox(Vec3(0.1, 0, 0)));
  EXPECT_TRUE(map.to_world(at(-0.1, 0, 0), false).position_m.isApprox(Vec3(0.1, 0, 0)));
  EXPECT_TRUE(map.to_world(at(0, 0, 0), false).position_m.isApprox(Vec3(0.2, 0, 0)));
  EXPECT_TRUE(map.to_hand(Vec3(0, 0, 1)).isApprox(Vec3(0, 0, 1)));
}

// Power is the same on both sides: a hand's damping b acts on an instrument that goes twice as far as b / 2 does.
TEST(Workspace, limits_are_those_at_the_instrument) {
  const DeviceLimits limits = limits_at_instrument(
      {.damping_n_s_per_m = 1, .mass_kg = 0.2, .largest_force_n = 8, .slew_n_per_s = 500, .largest_moment_n_m = 0.1},
      {.scale = 2, .force_scale = 0.5});
  EXPECT_DOUBLE_EQ(limits.damping_n_s_per_m, 1);
  EXPECT_DOUBLE_EQ(limits.mass_kg, 0.2);
  EXPECT_DOUBLE_EQ(limits.largest_force_n, 16);
  EXPECT_DOUBLE_EQ(limits.slew_n_per_s, 1000);
  EXPECT_DOUBLE_EQ(limits.largest_moment_n_m, 0.2);
  EXPECT_DOUBLE_EQ(limits_at_instrument({.damping_n_s_per_m = 1}, {.scale = 4}).damping_n_s_per_m, 0.25);
}

struct FakeHandle : Handle {
  struct Shared {
    HandleState state;
    bool fresh = false, lost = false;
    Vec3 force_n = Vec3::Zero(), moment_n_m = Vec3::Zero();
  };
  explicit FakeHandle(Shared& s) : shared(s) {}
  bool latest(HandleState& state) override {
    if (shared.fresh) state = shared.state;
    return std::exchange(shared.fresh, false);
  }
  void apply(const Vec3& force_n, const Vec3& moment_n_m) override {
    shared.force_n = force_n;
    shared.moment_n_m = moment_n_m;
  }
  bool lost() const override { return shared.lost; }
  Shared& shared;
};

TEST(HeldDevice, is_not_there_until_it_is_heard_and_while_it_is_lost) {
  FakeHandle::Shared handle;
  HeldDevice device(std::make_unique<FakeHandle>(handle), {.at_world_m = Vec3(0, 0, 0.1)}, 3);
  EXPECT_EQ(device.limits().largest_force_n, 3);
  device.pose_world(0);
  EXPECT_FALSE(device.present());
  handle.state.pose.position_m = Vec3(0.5, 0, 0);
  handle.fresh = true;
  EXPECT_TRUE(device.pose_world(0.001).position_m.isApprox(Vec3(0, 0, 0.1)));
  EXPECT_TRUE(device.present());
  handle.state.pose.position_m = Vec3(0.5, 0, -0.05);
  handle.fresh = true;
  EXPECT_TRUE(device.pose_world(0.002).position_m.isApprox(Vec3(0, 0, 0.05)));
  device.apply(Vec3(0, 0, 1));
  device.apply_moment(Vec3(0.01, 0, 0));
  EXPECT_EQ(handle.force_n.z(), 1);
  EXPECT_EQ(handle.moment_n_m.x(), 0.01);
  handle.lost = true;
  device.pose_world(0.003);
  EXPECT_FALSE(device.present());
  EXPECT_EQ(device.status(), DeviceStatus::lost);
  // It comes back where it appeared at first, not inside of the tissue in which it was lost.
  handle.lost = false;
  EXPECT_TRUE(device.pose_world(0.004).position_m.isApprox(Vec3(0, 0, 0.1)));
  EXPECT_TRUE(device.present());
  EXPECT_EQ(device.status(), DeviceStatus::ready);
}

TEST(HeldDevice, a_button_closes_jaws_and_a_gripper_leads_them) {
  FakeHandle::Shared handle;
  HeldDevice device(std::make_unique<FakeHandle>(handle), {}, 3);
  const auto run = [&](double from_s) {
    handle.fresh = true;
    for (int i = 0; i < 400; ++i) device.pose_world(from_s + 0.001 * i);
    return device.opening_rad(0);
  };
  EXPECT_DOUBLE_EQ(run(0), HeldDevice::kWidest_rad);
  handle.state.buttons.grip = true;
  EXPECT_DOUBLE_EQ(run(1), 0);
  handle.state.buttons.grip = false;
  handle.state.has_opening = true;
  handle.state.opening_share = 0.5;
  EXPECT_DOUBLE_EQ(run(2), HeldDevice::kWidest_rad / 2);
}

}  // namespace
}  // namespace sectio
