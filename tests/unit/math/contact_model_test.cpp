#include "common/math/contact_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

// A tool 2 mm deep in tissue of 200 N/m whose surface is z = 0.
ContactModel pressed() {
  ContactModel m;
  m.tool_time_s = 1;
  m.state = ContactState::contact;
  m.tip_world_m = Vec3(0, 0, -0.002);
  m.force_world_n = Vec3(0, 0, 0.4);
  m.stiffness_n_per_m = 200;
  m.yield_n = 5;
  m.valid_radius_m = 0.02;
  return m;
}

double normal_force(const ContactModel& m, double z_m, double now_s, double vz = 0) {
  return evaluate(m, Vec3(0, 0, z_m), Vec3(0, 0, vz), now_s).z();
}

TEST(ContactModel, is_a_spring_along_the_normal_that_only_pushes) {
  const ContactModel m = pressed();
  EXPECT_DOUBLE_EQ(normal_force(m, -0.002, 1), 0.4);
  EXPECT_NEAR(normal_force(m, -0.003, 1), 0.6, 1e-12);
  EXPECT_NEAR(normal_force(m, -0.001, 1), 0.2, 1e-12);
  EXPECT_EQ(normal_force(m, 0.001, 1), 0);
}

TEST(ContactModel, plane_moves_on_until_its_time_to_live) {
  ContactModel m = pressed();
  m.velocity_world_m_per_s = Vec3(0, 0, 0.01);
  EXPECT_NEAR(normal_force(m, -0.002, 0.9), 0.4, 1e-12);  // a clock that went back changes nothing
  EXPECT_NEAR(normal_force(m, -0.002, 1.04), 0.4 + 200 * 0.01 * 0.04, 1e-12);
  EXPECT_NEAR(normal_force(m, -0.002, 9), 0.4 + 200 * 0.01 * m.time_to_live_s, 1e-12);
}

TEST(ContactModel, never_exceeds_its_yield) {
  EXPECT_DOUBLE_EQ(normal_force(pressed(), -0.1, 1), 5);
  ContactModel m = pressed();
  m.force_world_n = Vec3(3, 4, 5) * 10;
  EXPECT_NEAR(evaluate(m, m.tip_world_m, Vec3::Zero(), 1).norm(), 5, 1e-12);
}

TEST(ContactModel, damps_motion_against_the_plane) {
  ContactModel m = pressed();
  m.damping_n_s_per_m = 2;
  m.velocity_world_m_per_s = Vec3(0, 0, 0.01);
  EXPECT_NEAR(normal_force(m, -0.002, 1, 0.01), 0.4, 1e-12);
  EXPECT_NEAR(normal_force(m, -0.002, 1, -0.01), 0.44, 1e-12);
}

TEST(ContactModel, sideways_force_sticks_up_to_friction_and_fades_when_lifted) {
  ContactModel m = pressed();
  m.tangential_stiffness_n_per_m = 100;
  m.friction = 0.5;
  EXPECT_NEAR(evaluate(m, Vec3(0.001, 0, -0.002), Vec3::Zero(), 1).x(), -0.1, 1e-12);
  EXPECT_NEAR(evaluate(m, Vec3(0.009, 0, -0.002), Vec3::Zero(), 1).x(), -0.2, 1e-12);
  m.force_world_n.x() = 0.3;  // the bound never reduces the server's own sideways force at the place of the fit
  EXPECT_NEAR(evaluate(m, m.tip_world_m, Vec3::Zero(), 1).x(), 0.3, 1e-12);
  EXPECT_EQ(evaluate(m, Vec3(0, 0, 0.001), Vec3::Zero(), 1).norm(), 0);
}

// A blade in a groove is pressed sideways. Its small normal force must not suppress the sideways force.
TEST(ContactModel, sideways_force_does_not_hang_on_a_small_normal_one) {
  ContactModel m = pressed();
  m.force_world_n = Vec3(1, 0, 0.002);
  const double before = evaluate(m, m.tip_world_m, Vec3::Zero(), 1).x();
  const double after = evaluate(m, m.tip_world_m + Vec3(0, 0, 2e-5), Vec3::Zero(), 1).x();
  EXPECT_NEAR(before, 1, 1e-12);
  EXPECT_NEAR(after, before, 0.01);
  EXPECT_NEAR(evaluate(m, m.tip_world_m + Vec3(0, 0, 0.006), Vec3::Zero(), 1).norm(), 0, 1e-12);
}

struct Follower {
  ContactModelFollower follower;
  double now_s = 1;
  Vec3 tip = Vec3(0, 0, -0.002);

  Vec3 tick() {
    now_s += 0.001;
    return follower.tick(tip, Vec3::Zero(), now_s);
  }
  // The newest model every `every` ticks, as a live server would send it.
  Vec3 live(ContactModel m, int ticks, int every = 16) {
    Vec3 force = Vec3::Zero();
    for (int i = 0; i < ticks; ++i) {
      if (i % every == 0) {
        m.tool_time_s = now_s;
        follower.receive(m);
      }
      force = tick();
    }
    return force;
  }
};

TEST(ContactModelFollower, no_model_no_force) {
  Follower f;
  EXPECT_EQ(f.tick(), Vec3::Zero());
  EXPECT_EQ(f.follower.model(), nullptr);
}

TEST(ContactModelFollower, force_has_no_jump_when_models_change) {
  Follower f;
  f.live(pressed(), 64);
  ContactModel other = pressed();
  other.force_world_n = Vec3(0.1, 0, 1.4);
  double largest_step_n = 0;
  Vec3 before = f.tick();
  f.follower.receive(other);
  for (int i = 0; i < 20; ++i) {
    const Vec3 force = f.tick();
    largest_step_n = std::max(largest_step_n, (force - before).norm());
    before = force;
  }
  EXPECT_TRUE(before.isApprox(other.force_world_n, 1e-9)) << before.transpose();
  EXPECT_LT(largest_step_n, 1.01 * (other.force_world_n - pressed().force_world_n).norm() / 8);
}

TEST(ContactModelFollower, follows_a_server_as_fast_as_itself) {
  Follower f;
  f.live(pressed(), 64, 1);
  ContactModel other = pressed();
  other.force_world_n = Vec3(0, 0, 0.8);
  EXPECT_NEAR(f.live(other, 64, 1).z(), 0.8, 1e-3);
}

double stiffness_felt(Follower f) {
  const double before = f.tick().z();
  f.tip.z() -= 1e-4;
  return (f.tick().z() - before) / 1e-4;
}

TEST(ContactModelFollower, stiffness_rises_slowly_and_falls_at_once) {
  Follower f;
  f.live(pressed(), 64);
  ContactModel stiffer = pressed();
  stiffer.stiffness_n_per_m = 400;
  f.live(stiffer, 10, 100);
  EXPECT_NEAR(stiffness_felt(f), 200 * std::pow(1.2, 1.2), 0.1);  // 12 ms on
  f.live(stiffer, 100, 16);
  EXPECT_NEAR(stiffness_felt(f), 400, 1);
  f.live(pressed(), 12, 100);
  EXPECT_NEAR(stiffness_felt(f), 200, 1);
}

TEST(ContactModelFollower, spring_is_dragged_along_when_it_slips) {
  ContactModel m = pressed();
  m.tangential_stiffness_n_per_m = 100;
  m.friction = 0.5;  // slips at 0.2 N, 2 mm
  Follower f;
  f.live(m, 20, 100);
  for (int i = 0; i < 50; ++i) {
    f.tip.x() += 1e-4;
    f.tick();
  }
  EXPECT_NEAR(f.tick().x(), -0.2, 1e-9);
  for (int i = 0; i < 20; ++i) {  // 2 mm back: the anchor was dragged by 3 mm, so the spring is at rest there
    f.tip.x() -= 1e-4;
    f.tick();
  }
  EXPECT_NEAR(f.tick().x(), 0, 1e-9);
}

TEST(ContactModelFollower, outside_its_radius_holds_then_fades) {
  Follower f;
  ContactModel m = pressed();
  m.valid_radius_m = 0.001;
  f.live(m, 20, 100);
  f.tip.z() -= 0.002;
  const double held = f.tick().z();
  EXPECT_NEAR(held, 0.4, 1e-6);
  for (int i = 0; i < 49; ++i) f.tick();
  EXPECT_NEAR(f.tick().z(), held / 2, 0.01);
  for (int i = 0; i < 60; ++i) f.tick();
  EXPECT_EQ(f.tick().z(), 0);
}

TEST(ContactModelFollower, silence_ramps_the_force_to_zero_without_a_jump) {
  Follower f;
  f.live(pressed(), 64);
  double before = f.tick().z();
  double largest_step_n = 0;
  int ticks = 0;
  while (before > 0 && ticks < 1000) {
    const double force = f.tick().z();
    EXPECT_LE(force, before);
    largest_step_n = std::max(largest_step_n, before - force);
    before = force;
    ++ticks;
  }
  EXPECT_LE(ticks * 0.001, ContactModelFollower::kSilence_s + ContactModelFollower::kDecay_s);
  EXPECT_LT(largest_step_n, 0.4 * 0.001 / ContactModelFollower::kDecay_s * 1.01);
  EXPECT_TRUE(f.follower.silent(f.now_s));

  const Vec3 force = f.live(pressed(), 1);  // the server is back: no jump either
  EXPECT_LT(force.norm(), 0.4 / 4);
  EXPECT_FALSE(f.follower.silent(f.now_s));
  EXPECT_NEAR(f.live(pressed(), 64).z(), 0.4, 1e-6);
}

}  // namespace
}  // namespace sectio
