#include "device_bridge/servo/servo_state.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace sectio::servo_test {
namespace {

ContactModel pushing(double force_n) {
  ContactModel model;
  model.state = ContactState::contact;
  model.force_world_n = Vec3(0, 0, force_n);
  model.point_world_m = Vec3(0, 0, 0.01);
  return model;
}

// Ticks at 1 kHz; the server sends at 60 Hz until it falls silent.
ServoRecord run(ServoState& state, ContactModel model, double from_s, double to_s, bool server_alive) {
  ServoRecord record;
  for (int i = static_cast<int>(std::lround(from_s * 1000)); i < static_cast<int>(std::lround(to_s * 1000)); ++i) {
    const double now_s = i * 0.001;
    model.tool_time_s = (i - 20) * 0.001;
    record = state.tick(now_s, Pose{}, server_alive && i % 16 == 0 ? &model : nullptr);
  }
  return record;
}

TEST(ServoState, tells_age_and_state) {
  ServoState state;
  EXPECT_LT(state.tick(0, Pose{}, nullptr).model_age_s, 0);
  const ServoRecord record = run(state, pushing(1), 0.001, 0.1, true);
  EXPECT_EQ(record.state, ContactState::contact);
  EXPECT_GE(record.model_age_s, 0.02);
  EXPECT_LE(record.model_age_s, 0.037);
  EXPECT_NEAR(record.force_world_n.z(), 1, 1e-3);
  EXPECT_EQ(record.sample.sequence, 100U);
}

TEST(ServoState, watchdog_ramps_the_force_to_zero_and_lets_go_again) {
  ServoState state;
  run(state, pushing(1), 0, 0.5, true);
  EXPECT_FALSE(run(state, pushing(1), 0.5, 0.58, false).server_silent);
  const ServoRecord half = run(state, pushing(1), 0.58, 0.65, false);
  EXPECT_TRUE(half.server_silent);
  EXPECT_GT(half.force_world_n.z(), 0.2);
  EXPECT_LT(half.force_world_n.z(), 0.8);
  EXPECT_EQ(run(state, pushing(1), 0.65, 1, false).force_world_n.norm(), 0);
  const ServoRecord back = run(state, pushing(1), 1, 1.1, true);
  EXPECT_FALSE(back.server_silent);
  EXPECT_NEAR(back.force_world_n.z(), 1, 1e-3);
}

TEST(ServoState, the_hand_never_gets_more_than_the_devices_force) {
  ServoState state{DeviceLimits{.largest_force_n = 3}};
  EXPECT_NEAR(run(state, pushing(1000), 0, 0.1, true).force_world_n.norm(), 3, 1e-9);
}

TEST(ServoState, force_rises_no_faster_than_the_device_can) {
  ServoState state{DeviceLimits{.slew_n_per_s = 100}};
  run(state, pushing(0), 0, 0.096, true);
  EXPECT_NEAR(run(state, pushing(5), 0.096, 0.116, true).force_world_n.norm(), 2, 1e-9);
  EXPECT_NEAR(run(state, pushing(5), 0.116, 0.3, true).force_world_n.norm(), 5, 1e-3);
}

// The hand's own way adds what the stiffest spring would, 0.7 * 2 b / T, whatever the server sends.
TEST(ServoState, force_on_a_hand_that_moves_rises_as_with_the_devices_stiffest_spring) {
  ServoState state{DeviceLimits{.damping_n_s_per_m = 0.2, .largest_force_n = 100, .slew_n_per_s = 100, .rate_hz = 500}};
  ContactModel model = pushing(0);
  model.stiffness_n_per_m = 1e6;
  run(state, model, 0, 0.1, true);
  const Pose deeper{Vec3(0, 0, -0.01), Eigen::Quaterniond::Identity()};
  EXPECT_LE(state.tick(0.1, deeper, nullptr).force_world_n.z(), 0.1 + 1.4 + 1e-9);
}

TEST(ServoState, a_broken_model_gives_no_force_and_is_forgotten) {
  ServoState state;
  EXPECT_EQ(run(state, pushing(std::numeric_limits<double>::quiet_NaN()), 0, 0.1, true).force_world_n, Vec3::Zero());
  EXPECT_NEAR(run(state, pushing(1), 0.1, 0.3, true).force_world_n.z(), 1, 1e-3);
}

// A server makes up models of any size and sign, sends broken numbers, answers samples that never were, and changes its
// mind each tick.
TEST(ServoState, no_server_exceeds_what_the_device_tells) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN(), kMuch = 1e300;
  test::Random random(11);
  const auto uniform = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
  const auto any_size = [&] { return std::pow(10, uniform(-6, 9)); };
  const auto any_way = [&] { return Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).stableNormalized(); };
  for (int trial = 0; trial < 200; ++trial) {
    const DeviceLimits device{uniform(0.05, 5),  uniform(0.02, 0.5), uniform(1, 20),
                              uniform(50, 2000), uniform(0.01, 1),   uniform(400, 4000)};
    ServoState state(device);
    const double tick_s = 1 / device.rate_hz, stiffest = 0.7 * 2 * device.damping_n_s_per_m * device.rate_hz;
    ContactModel model;
    Vec3 at_m = Vec3::Zero(), way_m = Vec3::Zero(), before_n = Vec3::Zero();
    for (int i = 0; i < 300; ++i) {
      if (i % 20 == 0) way_m = uniform(0, 0.5) * tick_s * any_way();
      if (i % 7 == 0) {
        model.state = static_cast<ContactState>(random() % 3);
        model.force_world_n = any_size() * any_way();
        model.lever_world_m = uniform(0, 1) * any_way();
        model.point_world_m = at_m + uniform(-0.01, 0.01) * any_way();
        model.normal_world = any_way();
        model.velocity_world_m_per_s = any_size() * any_way();
        model.stiffness_n_per_m = any_size(), model.damping_n_s_per_m = any_size(), model.mass_kg = any_size();
        model.side_stiffness_n_per_m = any_size(), model.friction = any_size(), model.yield_n = any_size();
        model.soft_depth_m = any_size();
      }
      if (i % 31 == 0) model.force_world_n.x() = random() % 2 ? kNone : kMuch;
      if (i % 37 == 0) model.stiffness_n_per_m = kMuch;
      model.tool_time_s = (i - uniform(-3, 30)) * tick_s;
      at_m += way_m;
      const ServoRecord record = state.tick(i * tick_s, {at_m, Eigen::Quaterniond::Identity()}, &model);
      const Vec3& force_n = record.force_world_n;
      ASSERT_LE(force_n.norm(), device.largest_force_n * (1 + 1e-9)) << trial << ", tick " << i;
      ASSERT_LE((force_n - before_n).norm(), (device.slew_n_per_s * tick_s + stiffest * way_m.norm()) * (1 + 1e-9))
          << trial << ", tick " << i;
      ASSERT_LE(record.moment_world_n_m.norm(), device.largest_moment_n_m * (1 + 1e-9)) << trial << ", tick " << i;
      before_n = force_n;
    }
  }
}

}  // namespace
}  // namespace sectio::servo_test
