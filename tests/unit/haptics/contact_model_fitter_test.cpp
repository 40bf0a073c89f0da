#include "sim_server/haptics/contact_model_fitter.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sectio {
namespace {

constexpr double kStep_s = 0.001;

// Tissue of a given stiffness under a tip that moves up and down, always in contact.
struct Tissue {
  double stiffness_n_per_m = 300;
  double surface_velocity_m_per_s = 0;
  double noise_n = 0;
  double expected_n_per_m = 200;

  ContactStep at(double t) const {
    ContactStep step;
    step.sim_time_s = step.tool_time_s = t;
    step.tip_world_m = Vec3(0, 0, -0.01 + 0.003 * std::sin(6 * t) + surface_velocity_m_per_s * t);
    step.surface_velocity_world_m_per_s = Vec3(0, 0, surface_velocity_m_per_s);
    step.surface_known = true;
    step.body_id = 0;
    step.tissue.stiffness_n_per_m = expected_n_per_m;
    step.point_world_m = Vec3(0, 0, surface_velocity_m_per_s * t);
    step.state = ContactState::contact;
    const double depth_m = (step.point_world_m - step.tip_world_m).z();
    step.reaction_world_n = Vec3(0, 0, stiffness_n_per_m * depth_m + noise_n * std::sin(1e5 * t));
    return step;
  }
};

ContactModel fitted(const Tissue& tissue, int steps = 400) {
  ContactModelFitter fitter(3);
  ContactModel model;
  for (int i = 0; i < steps; ++i) model = fitter.fit(tissue.at(i * kStep_s));
  return model;
}

TEST(B_FUT, B_FUT_1_force_for_haptics_generated) {
  const Tissue tissue;
  const ContactModel model = fitted(tissue);
  EXPECT_EQ(model.tool_id, 3U);
  EXPECT_EQ(model.sequence, 400U);
  EXPECT_EQ(model.state, ContactState::contact);
  // Evaluated a moment later at another place, the model gives the force of the tissue there.
  for (const double z_m : {-0.013, -0.010, -0.005, -0.001}) {
    const double force = evaluate(model, Vec3(0, 0, z_m), Vec3::Zero(), model.tool_time_s + 0.02).z();
    EXPECT_NEAR(force, 300 * -z_m, 0.01) << z_m;
  }
  EXPECT_EQ(evaluate(model, Vec3(0, 0, 0.002), Vec3::Zero(), model.tool_time_s).z(), 0);
}

TEST(ContactModelFitter, finds_the_stiffness_from_a_wrong_prior) {
  for (const double prior : {120.0, 150.0, 300.0, 600.0, 1400.0}) {
    EXPECT_NEAR(fitted(Tissue{.expected_n_per_m = prior}).stiffness_n_per_m, 300, 3) << prior;
  }
}

TEST(ContactModelFitter, stiffness_stays_near_what_the_tissue_should_have) {
  EXPECT_DOUBLE_EQ(fitted(Tissue{.expected_n_per_m = 50}).stiffness_n_per_m, 150);
  EXPECT_DOUBLE_EQ(fitted(Tissue{.expected_n_per_m = 2000}).stiffness_n_per_m, 400);
}

TEST(ContactModelFitter, a_resting_tip_teaches_nothing) {
  ContactModelFitter fitter(0);
  ContactStep step = Tissue{}.at(0);
  ContactModel model;
  for (int i = 0; i < 200; ++i) {
    step.sim_time_s = i * kStep_s;
    step.reaction_world_n.z() = 3 + 0.05 * std::sin(1e5 * i);
    model = fitter.fit(step);
  }
  EXPECT_DOUBLE_EQ(model.stiffness_n_per_m, FeltTissue{}.stiffness_n_per_m);
}

TEST(ContactModelFitter, moving_tissue_is_carried_on) {
  const Tissue tissue{300, 0.02};
  const ContactModel model = fitted(tissue);
  EXPECT_NEAR(model.stiffness_n_per_m, 300, 3);
  const double later_s = model.tool_time_s + 0.03;
  EXPECT_NEAR(evaluate(model, Vec3(0, 0, 0.02 * later_s - 0.008), Vec3::Zero(), later_s).z(), 2.4, 0.01);
}

TEST(ContactModelFitter, reaction_is_smoothed_without_lag) {
  const ContactModel noisy = fitted(Tissue{300, 0, 0.3});
  const double force = evaluate(noisy, noisy.tip_world_m, Vec3::Zero(), noisy.tool_time_s).z();
  EXPECT_NEAR(force, 300 * -noisy.tip_world_m.z(), 0.1);
}

TEST(ContactModelFitter, nothing_near_nothing_felt) {
  ContactStep step;
  step.tip_world_m = Vec3(0, 0, 0.1);
  const ContactModel model = ContactModelFitter(0).fit(step);
  EXPECT_EQ(model.state, ContactState::free);
  EXPECT_EQ(evaluate(model, Vec3(0, 0, -0.1), Vec3::Zero(), 0), Vec3::Zero());
}

TEST(ContactModelFitter, a_near_surface_is_met_without_waiting_for_the_server) {
  ContactStep step;
  step.tip_world_m = Vec3(0, 0, 0.003);
  step.surface_known = true;
  step.body_id = 0;
  step.gap_m = 0.003;
  const ContactModel model = ContactModelFitter(0).fit(step);
  EXPECT_EQ(evaluate(model, Vec3(0, 0, 0.001), Vec3::Zero(), 0).norm(), 0);
  EXPECT_NEAR(evaluate(model, Vec3(0, 0, -0.001), Vec3::Zero(), 0).z(), 0.2, 1e-12);
}

TEST(ContactModelFitter, same_steps_same_bits) {
  const ContactModel a = fitted(Tissue{300, 0.01, 0.1});
  const ContactModel b = fitted(Tissue{300, 0.01, 0.1});
  EXPECT_EQ(a.force_world_n, b.force_world_n);
  EXPECT_EQ(a.stiffness_n_per_m, b.stiffness_n_per_m);
}

}  // namespace
}  // namespace sectio
