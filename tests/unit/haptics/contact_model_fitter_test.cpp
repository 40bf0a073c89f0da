#include "sim_server/haptics/contact_model_fitter.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sectio::haptics_test {
namespace {

constexpr double kStep_s = 0.001;

// Tissue of a given response under a tip that moves up and down in it, with two tones.
struct Tissue {
  double stiffness_n_per_m = 300, damping_n_s_per_m = 0, mass_kg = 0;
  double surface_velocity_m_per_s = 0;
  double expected_n_per_m = 200;
  double way_m = 0.001;
};

// The tip's depth and how it changes, as the fitter sees it, after a number of steps.
ContactModel fitted(const Tissue& tissue, int steps = 600) {
  ContactModelFitter fitter(3);
  ContactModel truth;
  truth.stiffness_n_per_m = tissue.stiffness_n_per_m;
  truth.damping_n_s_per_m = tissue.damping_n_s_per_m;
  truth.mass_kg = tissue.mass_kg;
  ContactStep step;
  step.surface_known = true;
  step.body_id = 0;
  step.tissue.stiffness_n_per_m = tissue.expected_n_per_m;
  step.state = ContactState::contact;
  step.surface_velocity_world_m_per_s = Vec3(0, 0, tissue.surface_velocity_m_per_s);
  ContactModel model;
  for (int i = 0; i < steps; ++i) {
    const double t = i * kStep_s, surface_m = tissue.surface_velocity_m_per_s * t;
    const double wave = std::sin(40 * t) + 0.3 * std::sin(251 * t);
    const Vec3 tip_m(0, 0, surface_m - 0.004 + tissue.way_m * wave);
    if (i == 0)
      step.tip.position_m = tip_m;
    else
      step.tip.go_on(t, tip_m);
    step.sim_time_s = t;
    step.gap_m = tip_m.z() - surface_m;
    truth.tool_time_s = t;
    truth.point_world_m = Vec3(0, 0, surface_m);
    truth.velocity_world_m_per_s = step.surface_velocity_world_m_per_s;
    step.reaction_world_n = Vec3(0, 0, force_n(truth, dent_of(truth, step.tip)));
    model = fitter.fit(step);
  }
  return model;
}

TEST(B_FUT, B_FUT_1_force_for_haptics_generated) {
  const ContactModel model = fitted({});
  EXPECT_EQ(model.tool_id, 3U);
  EXPECT_EQ(model.sequence, 600U);
  EXPECT_EQ(model.state, ContactState::contact);
  EXPECT_GT(model.force_world_n.z(), 0.5);
  // Evaluated at another place, the response differs as the tissue does.
  const auto force_at = [&](double z_m) {
    return force_n(model, dent_of(model, {model.tool_time_s, Vec3(0, 0, z_m), Vec3::Zero(), Vec3::Zero()}));
  };
  EXPECT_NEAR(force_at(-0.005) - force_at(-0.003), 300 * 0.002, 0.03);
}

TEST(ContactModelFitter, finds_the_response_from_a_wrong_prior) {
  for (const double prior : {100.0, 300.0, 900.0}) {
    const ContactModel model = fitted({.damping_n_s_per_m = 1, .mass_kg = 0.004, .expected_n_per_m = prior});
    EXPECT_NEAR(model.stiffness_n_per_m, 300, 15) << prior;
    EXPECT_NEAR(model.damping_n_s_per_m, 1, 0.05) << prior;
    EXPECT_NEAR(model.mass_kg, 0.004, 0.0004) << prior;
  }
}

TEST(ContactModelFitter, no_part_of_the_response_is_negative) {
  const ContactModel model = fitted({.damping_n_s_per_m = -1, .mass_kg = -0.002});
  EXPECT_GE(model.stiffness_n_per_m, 0);
  EXPECT_GE(model.damping_n_s_per_m, 0);
  EXPECT_GE(model.mass_kg, 0);
}

TEST(ContactModelFitter, a_resting_tip_teaches_nothing) {
  EXPECT_NEAR(fitted({.way_m = 1e-6}).stiffness_n_per_m, 200, 2);
  EXPECT_EQ(fitted({.way_m = 0}).stiffness_n_per_m, 200);
}

TEST(ContactModelFitter, moving_tissue_is_carried_on) {
  const ContactModel model = fitted({.surface_velocity_m_per_s = 0.02});
  EXPECT_NEAR(model.stiffness_n_per_m, 300, 15);
  EXPECT_NEAR(model.velocity_world_m_per_s.z(), 0.02, 1e-9);
}

TEST(ContactModelFitter, nothing_near_nothing_felt) {
  ContactStep step;
  step.tip.position_m = Vec3(0, 0, 0.1);
  const ContactModel model = ContactModelFitter(0).fit(step);
  EXPECT_EQ(model.state, ContactState::free);
  EXPECT_EQ(model.stiffness_n_per_m, 0);
  EXPECT_EQ(model.side_stiffness_n_per_m, 0);
}

TEST(ContactModelFitter, a_near_surface_is_told_before_the_touch) {
  ContactStep step;
  step.tip.position_m = Vec3(0, 0, 0.003);
  step.surface_known = true;
  step.body_id = 0;
  step.gap_m = 0.001;  // a ball of 2 mm about the tip
  const ContactModel model = ContactModelFitter(0).fit(step);
  EXPECT_EQ(model.stiffness_n_per_m, FeltTissue{}.stiffness_n_per_m);
  EXPECT_NEAR(model.point_world_m.z(), 0.002, 1e-12);
}

TEST(ContactModelFitter, a_force_above_the_plane_says_where_the_plane_is) {
  ContactStep step;
  step.surface_known = true;
  step.body_id = 0;
  step.state = ContactState::contact;
  step.gap_m = 0.001;
  step.reaction_world_n = Vec3(0, 0, 0.1);
  const ContactModel model = ContactModelFitter(0).fit(step);
  EXPECT_NEAR(force_n(model, dent_of(model, {})), 0.1, 1e-9);
}

TEST(ContactModelFitter, a_blade_in_tissue_yields_at_the_force_that_it_has) {
  ContactModelFitter fitter(0);
  ContactStep step;
  step.body_id = 0;
  step.state = ContactState::penetration;
  step.reaction_world_n = Vec3(1, 0, 0);
  for (int i = 0; i < 100; ++i) {
    step.sim_time_s = i * kStep_s;
    fitter.fit(step);
  }
  step.sim_time_s += kStep_s;
  const ContactModel model = fitter.fit(step);
  EXPECT_NEAR(model.yield_n, 1, 1e-3);
  EXPECT_EQ(model.stiffness_n_per_m, 0);
  EXPECT_EQ(model.side_stiffness_n_per_m, 0) << "nothing holds it";
}

TEST(ContactModelFitter, the_front_of_a_cut_is_told_as_it_is) {
  ContactStep step;
  step.body_id = 0;
  step.state = ContactState::penetration;
  step.reaction_world_n = Vec3(-1, 0, 0);
  step.front = {1200, 1.6, Vec3::UnitX()};
  const ContactModel model = ContactModelFitter(0).fit(step);
  EXPECT_EQ(model.force_world_n, step.reaction_world_n);
  EXPECT_EQ(model.side_stiffness_n_per_m, 1200);
  EXPECT_EQ(model.yield_n, 1.6);
  EXPECT_EQ(model.normal_world, Vec3(-Vec3::UnitX())) << "against the way of the blade";
}

TEST(ContactModelFitter, same_steps_same_bits) {
  const ContactModel a = fitted({.mass_kg = 0.003}), b = fitted({.mass_kg = 0.003});
  EXPECT_EQ(a.force_world_n, b.force_world_n);
  EXPECT_EQ(a.stiffness_n_per_m, b.stiffness_n_per_m);
}

}  // namespace
}  // namespace sectio::haptics_test
