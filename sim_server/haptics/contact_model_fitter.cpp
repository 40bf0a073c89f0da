#include "sim_server/haptics/contact_model_fitter.h"

#include <algorithm>
#include <utility>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kLeastOfPrior = 0.2;  // the stiffness stays within these multiples of the prior
constexpr double kMostOfPrior = 3;
// The weight of the previous estimate: that of a window in which the tip moves 5 um a step.
constexpr double kMemory_m2 = 32 * 25e-12;

}  // namespace

ContactModelFitter::ContactModelFitter(std::uint32_t tool_id, const FitterSpec& spec)
    : tool_id_(tool_id), spec_(spec) {}

ContactModel ContactModelFitter::fit(const ContactStep& step) {
  SECTIO_ASSERT(step.reaction_world_n.allFinite() && step.tip_world_m.allFinite(), "a contact must be finite");
  meet(step);
  follow_surface(step);
  if (step.state != ContactState::free) {
    follow(step);
    fit_stiffness();
  }
  touching_ = step.state != ContactState::free;
  last_ = step;

  ContactModel model;
  model.tool_id = tool_id_;
  model.sequence = ++sequence_;
  model.sim_time_s = step.sim_time_s;
  model.tool_time_s = step.tool_time_s;
  model.state = step.state;
  model.point_world_m = step.point_world_m;
  model.normal_world = step.normal_world;
  model.velocity_world_m_per_s = surface_velocity_m_per_s_;
  model.stiffness_n_per_m = stiffness_n_per_m_;
  model.tangential_stiffness_n_per_m = spec_.tangential_fraction * stiffness_n_per_m_;
  model.friction = tissue_.friction;
  model.yield_n = tissue_.yield_n;
  model.valid_radius_m = spec_.valid_radius_m;
  model.time_to_live_s = spec_.time_to_live_s;
  if (!touching_) return free_model(model, step);

  // Force and tip have passed the same filter, so they match each other; the tissue has since moved by v_p tau.
  model.force_world_n = smooth_force_n_;
  model.tip_world_m = smooth_tip_m_ + spec_.force_filter_s * surface_velocity_m_per_s_;
  return model;
}

// Nothing that one body has taught is true of another. A tool that leaves a body for the air keeps what it knows.
void ContactModelFitter::meet(const ContactStep& step) {
  if (step.body_id == kNoBody) return;
  tissue_ = step.tissue;
  if (step.body_id == std::exchange(body_id_, step.body_id)) return;
  stiffness_n_per_m_ = tissue_.stiffness_n_per_m;
  window_ = {};
  surface_known_ = touching_ = false;
}

void ContactModelFitter::follow_surface(const ContactStep& step) {
  const double dt = step.sim_time_s - last_.sim_time_s;
  const double share = surface_known_ ? dt / (dt + spec_.velocity_filter_s) : 1;
  surface_velocity_m_per_s_ += share * (step.surface_velocity_world_m_per_s - surface_velocity_m_per_s_);
  surface_known_ = step.surface_known;
}

// Adds a step of a contact to the filters and to the window.
void ContactModelFitter::follow(const ContactStep& step) {
  if (!touching_) {
    window_ = {};
    smooth_force_n_ = step.reaction_world_n;
    smooth_tip_m_ = step.tip_world_m;
    return;
  }
  const double dt = step.sim_time_s - last_.sim_time_s;
  const double share = dt / (dt + spec_.force_filter_s);
  smooth_force_n_ += share * (step.reaction_world_n - smooth_force_n_);
  smooth_tip_m_ += share * (step.tip_world_m - smooth_tip_m_);

  const Vec3 moved_m = step.tip_world_m - last_.tip_world_m - dt * surface_velocity_m_per_s_;
  newest_ = (newest_ + 1) % kWindow;
  window_[newest_] = {step.normal_world.dot(step.reaction_world_n - last_.reaction_world_n),
                      step.normal_world.dot(moved_m)};
}

// Least squares for df = -k dx over the window, regularised by the previous estimate, as a resting tip gives no data.
void ContactModelFitter::fit_stiffness() {
  double xx = kMemory_m2;
  double xf = -kMemory_m2 * stiffness_n_per_m_;
  for (const Change& change : window_) {
    xx += change.distance_m * change.distance_m;
    xf += change.distance_m * change.force_n;
  }
  const double prior = tissue_.stiffness_n_per_m;
  stiffness_n_per_m_ = std::clamp(-xf / xx, kLeastOfPrior * prior, kMostOfPrior * prior);
}

// The model of a free tool: no force, and the plane of the surface if that is known.
ContactModel ContactModelFitter::free_model(ContactModel model, const ContactStep& step) const {
  model.tip_world_m = step.tip_world_m - step.gap_m * step.normal_world;
  if (!step.surface_known) {
    model.stiffness_n_per_m = 0;
    model.tangential_stiffness_n_per_m = 0;
  }
  return model;
}

}  // namespace sectio
