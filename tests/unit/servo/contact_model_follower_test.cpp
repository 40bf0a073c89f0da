#include "device_bridge/servo/contact_model_follower.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace sectio::servo_test {
namespace {

// A tool 2 mm deep in tissue of 200 N/m whose surface is z = 0.
ContactModel pressed() {
  ContactModel m;
  m.state = ContactState::contact;
  m.force_world_n = Vec3(0, 0, 0.4);
  m.stiffness_n_per_m = 200;
  m.soft_depth_m = 0;
  return m;
}

// A hand at 1 kHz, and a server that answers each of its samples after a delay.
struct Followed {
  explicit Followed(const DeviceLimits& device = {}) : follower(device) {}

  Vec3 tick() {
    now_s += 0.001;
    return follower.tick(now_s, tip, true);
  }
  Vec3 live(ContactModel m, int ticks, int delay_ticks = 1) {
    Vec3 force = Vec3::Zero();
    for (int i = 0; i < ticks; ++i) {
      m.tool_time_s = now_s - 0.001 * (delay_ticks - 1);
      follower.receive(m);
      force = tick();
    }
    return force;
  }

  ContactModelFollower follower;
  double now_s = 1;
  Vec3 tip = Vec3(0, 0, -0.002);
};

TEST(ContactModelFollower, no_model_no_force) {
  Followed loop;
  EXPECT_EQ(loop.tick(), Vec3::Zero());
  EXPECT_EQ(loop.follower.model(), nullptr);
}

TEST(ContactModelFollower, force_is_the_servers_and_changes_with_the_hands_own_motion) {
  Followed loop;
  EXPECT_NEAR(loop.live(pressed(), 200).z(), 0.4, 1e-6);
  loop.tip.z() -= 0.001;
  EXPECT_NEAR(loop.tick().z(), 0.6, 1e-6);
  loop.tip.z() = 0.0005;
  EXPECT_EQ(loop.tick().norm(), 0) << "out of the tissue";
}

// The server's force is that of 25 ms ago, and its stiffness is wrong: a sine, prescribed.
TEST(ContactModelFollower, only_the_change_within_the_delay_can_be_wrong) {
  for (const double stiffness : {200.0, 150.0}) {
    Followed loop;
    const auto depth_m = [](double t) { return 0.003 + 0.001 * std::sin(20 * t); };
    double error = 0, all = 0;
    for (int i = 0; i < 2000; ++i) {
      ContactModel m = pressed();
      m.stiffness_n_per_m = stiffness;
      m.tool_time_s = loop.now_s - 0.024;
      m.force_world_n.z() = 200 * depth_m(m.tool_time_s);
      loop.follower.receive(m);
      loop.tip.z() = -depth_m(loop.now_s + 0.001);
      const double felt = loop.tick().z(), truth = -200 * loop.tip.z();
      if (i < 500) continue;
      error += (felt - truth) * (felt - truth);
      all += (truth - 0.6) * (truth - 0.6);
    }
    EXPECT_LT(std::sqrt(error / all), stiffness == 200 ? 1e-6 : 0.16) << stiffness;
  }
}

TEST(ContactModelFollower, another_response_is_no_other_force) {
  Followed loop;
  loop.live(pressed(), 200);
  for (const double stiffness : {400.0, 100.0}) {
    ContactModel other = pressed();
    other.stiffness_n_per_m = stiffness;
    EXPECT_NEAR(loop.live(other, 1).z(), 0.4, 1e-6);
    EXPECT_NEAR(loop.live(other, 200).z(), 0.4, 1e-6);
  }
}

TEST(ContactModelFollower, a_plane_that_is_known_is_met_without_waiting) {
  Followed loop;
  loop.tip.z() = 0.001;
  ContactModel near = pressed();
  near.state = ContactState::free;
  near.force_world_n.setZero();
  EXPECT_EQ(loop.live(near, 50).norm(), 0);
  loop.tip.z() = -0.0005;
  EXPECT_NEAR(loop.tick().z(), 0.1, 1e-9);
}

TEST(ContactModelFollower, knows_its_own_samples_only) {
  Followed loop;
  loop.live(pressed(), 50);
  for (const double ago_s : {-0.01, 0.3, 0.5}) {
    ContactModel other = pressed();
    other.force_world_n.z() = 5;
    for (int i = 0; i < 20; ++i) {
      other.tool_time_s = loop.now_s - ago_s;
      loop.follower.receive(other);
      EXPECT_LT(loop.tick().z(), 0.41) << ago_s;
    }
  }
}

TEST(ContactModelFollower, a_far_server_is_felt_and_one_that_is_too_far_is_told) {
  Followed loop;
  for (int i = 0; i < 1500; ++i) loop.tick();
  EXPECT_NEAR(loop.live(pressed(), 2000, 400).z(), 0.4, 1e-6);
  EXPECT_EQ(loop.follower.too_old_s(), 0);
  EXPECT_NEAR(loop.live(pressed(), 1000, 600).norm(), 0, 1e-9);
  EXPECT_NEAR(loop.follower.too_old_s(), 0.6, 0.002);
  EXPECT_NEAR(loop.live(pressed(), 1000, 20).z(), 0.4, 1e-6);
  EXPECT_EQ(loop.follower.too_old_s(), 0);
}

TEST(ContactModelFollower, a_response_is_scaled_to_what_the_device_can_do) {
  ContactModel stiff = pressed();
  stiff.stiffness_n_per_m = 1e5;
  stiff.damping_n_s_per_m = 100;
  stiff.mass_kg = 1;
  stiff.side_stiffness_n_per_m = 1e5;
  for (const DeviceLimits& device : {DeviceLimits{}, DeviceLimits{.damping_n_s_per_m = 0.2, .mass_kg = 0.05}}) {
    Followed loop(device);
    loop.live(stiff, 5);
    const ContactModel& m = *loop.follower.model();
    const double damping = device.damping_n_s_per_m + kHandDamping_n_s_per_m;
    EXPECT_LE(m.stiffness_n_per_m * 0.0005 + m.damping_n_s_per_m, damping);
    EXPECT_LT(m.mass_kg, device.mass_kg);
    EXPECT_LE(m.side_stiffness_n_per_m, loop.follower.stiffest_n_per_m(damping));
  }
}

// A damping that the device can't give takes nothing from the spring, and the soft part of a stiff spring stays.
TEST(ContactModelFollower, a_response_keeps_the_part_that_the_device_can_do) {
  ContactModel damped = pressed();
  damped.damping_n_s_per_m = 100;
  damped.mass_kg = 1;
  Followed loop;
  loop.live(damped, 5);
  EXPECT_EQ(loop.follower.model()->stiffness_n_per_m, 200);
  ContactModel stiff = pressed();
  stiff.stiffness_n_per_m = 2 * loop.follower.stiffest_n_per_m(1.5);
  stiff.soft_depth_m = 0.0015;
  loop.live(stiff, 5);
  const auto force_at_n = [](const ContactModel& model, double depth_m) {
    return force_n(model, dent_of(model, {model.tool_time_s, Vec3(0, 0, -depth_m)}));
  };
  for (const double depth_m : {1e-4, 3e-4})
    EXPECT_NEAR(force_at_n(*loop.follower.model(), depth_m), force_at_n(stiff, depth_m), 1e-9) << depth_m;
  EXPECT_NEAR(force_at_n(*loop.follower.model(), 0.004) - force_at_n(*loop.follower.model(), 0.003),
              loop.follower.stiffest_n_per_m(1.5) * 0.001, 1e-9);
}

// A device without a spring of its own is pushed against tissue behind a wire, and knocked so little that it stays in
// touch.
TEST(ContactModelFollower, gives_no_energy_to_a_device_behind_any_wire) {
  constexpr double kPush_n = 1, kKnock_m_per_s = 0.001;
  for (const DeviceLimits& device : {DeviceLimits{}, DeviceLimits{.damping_n_s_per_m = 0.2, .mass_kg = 0.05}})
    for (const double stiffness_n_per_m : {200.0, 2000.0})
      for (const double wrong : {0.85, 1.15})
        for (const int delay_ticks : {1, 25, 50, 200, 400}) {
          Followed loop(device);
          const double damping = device.damping_n_s_per_m + kHandDamping_n_s_per_m;
          std::vector<double> depths_m;
          double depth_m = kPush_n / stiffness_n_per_m, speed_m_per_s = kKnock_m_per_s, most_m_per_s = 0;
          constexpr int kTicks = 10000;
          for (int i = 0; i < kTicks; ++i) {
            depths_m.push_back(depth_m);
            loop.tip.z() = -depth_m;
            ContactModel model = pressed();
            model.stiffness_n_per_m = stiffness_n_per_m;
            const int then = i - delay_ticks;
            if (then >= 0) {
              model.tool_time_s = loop.now_s + 0.001 - 0.001 * delay_ticks;
              model.force_world_n.z() =
                  wrong * stiffness_n_per_m * std::max(0.0, depths_m[static_cast<std::size_t>(then)]);
              loop.follower.receive(model);
            }
            const double force_n = loop.tick().z();
            speed_m_per_s += 0.001 / device.mass_kg * (kPush_n - force_n - damping * speed_m_per_s);
            depth_m += 0.001 * speed_m_per_s;
            if (i > kTicks - 1000) most_m_per_s = std::max(most_m_per_s, std::abs(speed_m_per_s));
          }
          EXPECT_LT(most_m_per_s, 0.05 * kKnock_m_per_s)
              << device.mass_kg << " kg, " << wrong << " x " << stiffness_n_per_m << " N/m, " << delay_ticks << " ms";
        }
}

TEST(ContactModelFollower, sticks_up_to_friction_and_is_dragged_along) {
  ContactModel m = pressed();
  m.side_stiffness_n_per_m = 100;
  m.friction = 0.5;  // slips at 0.2 N, 2 mm
  Followed loop;
  loop.live(m, 100);
  for (int i = 0; i < 50; ++i) {
    loop.tip.x() += 1e-4;
    loop.tick();
  }
  EXPECT_NEAR(loop.tick().x(), -0.2, 1e-6);
  for (int i = 0; i < 20; ++i) {  // 2 mm back: the anchor was dragged by 3 mm, so the spring is at rest there
    loop.tip.x() -= 1e-4;
    loop.tick();
  }
  EXPECT_NEAR(loop.tick().x(), 0, 1e-6);
  loop.tip.z() = 0.001;
  EXPECT_EQ(loop.tick().norm(), 0);
}

// An edge in a groove is pressed sideways. Its small normal force must not suppress the sideways force.
TEST(ContactModelFollower, sideways_force_does_not_hang_on_a_small_normal_one) {
  ContactModel m = pressed();
  m.side_stiffness_n_per_m = 100;
  m.friction = 0.5;
  m.force_world_n = Vec3(1, 0, 5e-4);
  Followed loop;
  EXPECT_NEAR(loop.live(m, 2000).x(), 1, 1e-3);
}

// In the tissue a blade is held all around, and goes on where that yields.
TEST(ContactModelFollower, a_blade_is_held_until_the_tissue_yields) {
  ContactModel m = pressed();
  m.state = ContactState::penetration;
  m.force_world_n = Vec3(-0.5, 0, 0);
  m.stiffness_n_per_m = 0;
  m.side_stiffness_n_per_m = 200;
  m.yield_n = 0.5;
  Followed loop;
  loop.live(m, 1000);
  double most_n = 0;
  for (int i = 0; i < 200; ++i) {
    loop.tip.x() += 1e-4;
    most_n = std::max(most_n, loop.live(m, 1, 20).norm());
  }
  EXPECT_NEAR(loop.tick().x(), -0.5, 1e-3);
  EXPECT_LE(most_n, 0.5 + 1e-9);
}

TEST(ContactModelFollower, silence_ramps_the_force_to_zero_without_a_jump) {
  Followed loop;
  double before = loop.live(pressed(), 200).z(), largest_step_n = 0;
  int ticks = 0;
  for (; before > 0 && ticks < 1000; ++ticks) {
    const double force = loop.tick().z();
    EXPECT_LE(force, before + 1e-12);
    largest_step_n = std::max(largest_step_n, before - force);
    before = force;
  }
  EXPECT_LE(ticks * 0.001, ContactModelFollower::kSilence_s + ContactModelFollower::kDecay_s + 0.002);
  EXPECT_LT(largest_step_n, 0.4 * 0.001 / ContactModelFollower::kDecay_s * 1.01);
  EXPECT_TRUE(loop.follower.silent(loop.now_s));
  for (int i = 0; i < 200; ++i) {
    const double force = loop.live(pressed(), 1).z();
    EXPECT_LT(force - before, 0.4 * 0.001 / ContactModelFollower::kReturn_s * 1.01) << "the server is back";
    before = force;
  }
  EXPECT_NEAR(before, 0.4, 1e-6);
  EXPECT_FALSE(loop.follower.silent(loop.now_s));
}

// The server halts while the tissue in the jaws moves, and is where it was when it goes on.
TEST(ContactModelFollower, a_grip_comes_back_after_a_silence_as_it_was) {
  ContactModel m = pressed();
  m.state = ContactState::held;
  m.force_world_n = Vec3(0.2, 0, 0);
  m.side_stiffness_n_per_m = 200;
  m.yield_n = 2;
  m.velocity_world_m_per_s = Vec3(0.02, 0, 0);
  Followed loop;
  loop.live(m, 200);
  double most_n = 0;
  for (int i = 0; i < 2000; ++i) most_n = std::max(most_n, loop.tick().norm());
  m.velocity_world_m_per_s.setZero();
  for (int i = 0; i < 400; ++i) most_n = std::max(most_n, loop.live(m, 1).norm());
  EXPECT_LT(most_n, 0.8) << "it has moved by 2 mm until the silence was known";
  EXPECT_NEAR(loop.live(m, 1).x(), 0.2, 0.02);
}

}  // namespace
}  // namespace sectio::servo_test
