#include "common/math/contact_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sectio::math_test {
namespace {

// Tissue whose surface is z = 0, at tool time 1 s.
ContactModel tissue() {
  ContactModel m;
  m.tool_time_s = 1;
  m.state = ContactState::contact;
  m.stiffness_n_per_m = 200;
  m.damping_n_s_per_m = 2;
  m.mass_kg = 0.01;
  m.soft_depth_m = 0.001;
  return m;
}

TipMotion tip_at(double z_m, double now_s = 1, double vz = 0, double az = 0) {
  return {now_s, Vec3(0.3, 0.2, z_m), Vec3(5, 6, vz), Vec3(7, 8, az)};
}

double force(double z_m, double now_s = 1, double vz = 0, double az = 0) {
  return force_n(tissue(), dent_of(tissue(), tip_at(z_m, now_s, vz, az)));
}

TEST(ContactModel, is_hertzian_where_it_is_soft_and_straight_beneath) {
  EXPECT_EQ(force(0.001), 0);
  EXPECT_NEAR(force(-0.00025), 200 * 2.0 / 3 * 0.00025 * 0.5, 1e-12);
  EXPECT_NEAR(force(-0.001), 200 * 2.0 / 3 * 0.001, 1e-12);
  EXPECT_NEAR(force(-0.003), force(-0.001) + 200 * 0.002, 1e-12);
  const double slope = (force(-0.001 - 1e-7) - force(-0.001 + 1e-7)) / 2e-7;
  EXPECT_NEAR(slope, 200, 0.1) << "where one goes over into the other";
}

TEST(ContactModel, resists_motion_and_acceleration_as_much_as_the_dent_has_opened) {
  EXPECT_NEAR(force(-0.003, 1, -0.1) - force(-0.003), 0.2, 1e-12);
  EXPECT_NEAR(force(-0.003, 1, 0, -2) - force(-0.003), 0.02, 1e-12);
  EXPECT_NEAR(force(-0.00025, 1, -0.1) - force(-0.00025), 0.1, 1e-12);
  EXPECT_EQ(force(0.001, 1, -0.1, -2), 0) << "air resists nothing";
}

TEST(ContactModel, plane_goes_on_for_a_while) {
  ContactModel m = tissue();
  m.velocity_world_m_per_s = Vec3(0, 0, 0.01);
  const auto depth_m = [&](double now_s) { return dent_of(m, tip_at(-0.002, now_s)).depth_m; };
  EXPECT_NEAR(depth_m(0.9), 0.002, 1e-12) << "a clock that went back changes nothing";
  EXPECT_NEAR(depth_m(1.04), 0.0024, 1e-12);
  EXPECT_NEAR(depth_m(99), 0.0045, 1e-12);
  EXPECT_NEAR(dent_of(m, tip_at(-0.002, 1, 0.01)).damper_m_per_s, 0, 1e-12) << "the tip goes with it";
}

TEST(ContactModel, motion_is_the_same_however_its_samples_came) {
  TipMotion tip{0, Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  const auto at = [](double t) { return Vec3(0, 0, 0.001 * std::sin(20 * t)); };
  for (int i = 1; i <= 1000; ++i) tip.go_on(i * 0.001, at(i * 0.001));
  EXPECT_NEAR(tip.velocity_m_per_s.z(), 0.02 * std::cos(20 * (1 - TipMotion::kVelocityFilter_s)), 4e-4);
  EXPECT_NEAR(tip.acceleration_m_per_s2.z(), -0.4 * std::sin(20 * (1 - TipMotion::kVelocityFilter_s)), 0.01);
  TipMotion again = tip;
  again.go_on(1, at(1));
  EXPECT_EQ(again.velocity_m_per_s, tip.velocity_m_per_s) << "the same sample twice";
}

}  // namespace
}  // namespace sectio::math_test
