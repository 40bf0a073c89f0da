#include "sim_server/haptics/contact_model_fitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/core/error.h"
#include "common/math/low_pass.h"

namespace sectio {
namespace {

constexpr double kSideways = 0.6;           // side stiffness over that along the normal
constexpr double kVelocityFilter_s = 0.02;  // the surface's velocity, which the bridge extrapolates
constexpr double kForceFilter_s = 0.005;
constexpr double kGripFilter_s = 0.005;  // the velocity of what jaws hold
constexpr double kMean_s = 0.1;          // running means: longer ones carry the approach into the fit
constexpr double kMemory_s = 0.15;       // likewise
constexpr double kSolve_s = 0.01;
constexpr int kSweeps = 60;
constexpr double kYieldRises_s = 0.004, kYieldFalls_s = 0.01;

// The prior weighs as much as kPriorRows samples of a sine of 15 Hz and 20 um: a hand that rests teaches nothing.
constexpr double kPriorRows = 150, kPriorWay_m = 2e-5, kPriorRate = 2 * std::numbers::pi * 15;

}  // namespace

const ContactModel& ContactModelFitter::fit(const ContactStep& step) {
  SECTIO_ASSERT(step.reaction_world_n.allFinite() && step.tip.position_m.allFinite(), "a contact must be finite");
  const double dt = model_.sequence > 0 ? step.sim_time_s - model_.sim_time_s : 0;
  meet(step);
  place(step);
  ++model_.sequence;
  model_.sim_time_s = step.sim_time_s;
  model_.tool_time_s = step.tip.time_s;
  model_.state = step.state;
  const bool is_held = step.state == ContactState::held;
  // Samples of a hand come in bursts, and springs answer each of them.
  model_.force_world_n +=
      (is_held ? low_pass_share(dt, kForceFilter_s) : 1) * (step.reaction_world_n - model_.force_world_n);
  model_.lever_world_m = step.lever_world_m;

  const double pushes_n = step.normal_world.dot(step.reaction_world_n);
  const bool presses = step.state == ContactState::contact;
  if (presses) {
    const Dent dent = dent_of(model_, step.tip);
    learn({dent.spring_m, dent.damper_m_per_s, dent.mass_m_per_s2 + tissue_.damping_per_s * dent.damper_m_per_s},
          pushes_n, dt);
  }
  touching_ = presses;
  until_solved_s_ -= dt;
  if (until_solved_s_ <= 0) solve();

  const bool is_known = step.state != ContactState::free || step.surface_known;
  const bool in_tissue = step.state == ContactState::penetration;
  model_.stiffness_n_per_m = is_known && !in_tissue ? theta_[0] : 0;
  model_.mass_kg = is_known && !in_tissue ? theta_[2] : 0;
  model_.damping_n_s_per_m = is_known && !in_tissue ? theta_[1] + tissue_.damping_per_s * theta_[2] : 0;
  model_.side_stiffness_n_per_m = is_known ? kSideways * tissue_.stiffness_n_per_m : 0;
  model_.friction = tissue_.friction;
  if (is_held) return hold(step.grip);
  const bool front_holds = in_tissue && step.front.strength_n > 0;
  if (in_tissue) model_.side_stiffness_n_per_m = front_holds ? step.front.stiffness_n_per_m : 0;
  if (front_holds) {
    model_.normal_world = -step.front.ahead_world;
    model_.yield_n = step.front.strength_n;
  } else if (!in_tissue) {
    model_.yield_n = tissue_.yield_n;
  } else {
    const double force_n = model_.force_world_n.norm(), before_n = std::min(model_.yield_n, force_n + 1);
    model_.yield_n =
        before_n + low_pass_share(dt, force_n > before_n ? kYieldRises_s : kYieldFalls_s) * (force_n - before_n);
  }
  return model_;
}

// A piece is as stiff as its springs at most, and in the air it has no stiffness: the hand is told half of it, and
// never errs by more. Tissue that is held by its points may be stiffer.
const ContactModel& ContactModelFitter::hold(const FeltGrip& grip) {
  model_.stiffness_n_per_m = model_.damping_n_s_per_m = model_.mass_kg = 0;
  model_.side_stiffness_n_per_m = 0.5 * grip.stiffness_n_per_m;
  if (grip.is_tissue)
    model_.side_stiffness_n_per_m = std::max(model_.side_stiffness_n_per_m, tissue_.stiffness_n_per_m);
  model_.yield_n = grip.largest_force_n;
  return model_;
}

// Nothing that one body has taught is true of another. A tool that leaves a body for the air keeps what it knows.
void ContactModelFitter::meet(const ContactStep& step) {
  if (step.body_id == kNoBody) return;
  tissue_ = step.tissue;
  if (step.body_id == std::exchange(body_id_, step.body_id)) return;
  responses_.setZero();
  forces_.setZero();
  until_solved_s_ = 0;
  surface_known_ = touching_ = false;
}

void ContactModelFitter::place(const ContactStep& step) {
  const double dt = step.sim_time_s - model_.sim_time_s;
  const bool in_tissue = step.state == ContactState::penetration, is_held = step.state == ContactState::held;
  const bool goes_on = is_held || model_.state == ContactState::held
                           ? model_.state == step.state
                           : surface_known_ && in_tissue == (model_.state == ContactState::penetration);
  const Vec3& moves_m_per_s = is_held     ? step.grip.velocity_world_m_per_s
                              : in_tissue ? step.front.velocity_world_m_per_s
                                          : step.surface_velocity_world_m_per_s;
  model_.velocity_world_m_per_s += (goes_on ? low_pass_share(dt, is_held ? kGripFilter_s : kVelocityFilter_s) : 1) *
                                   (moves_m_per_s - model_.velocity_world_m_per_s);
  surface_known_ = step.surface_known;
  model_.normal_world = step.normal_world;
  double gap_m = step.gap_m;
  // A force that comes before the plane does says where the plane is.
  const double pushes_n = step.normal_world.dot(step.reaction_world_n);
  if (step.state == ContactState::contact && gap_m > 0)
    gap_m = -std::max(0.0, pushes_n) / tissue_.stiffness_n_per_m - model_.soft_depth_m / 3;
  model_.point_world_m = step.tip.position_m - gap_m * step.normal_world;
}

void ContactModelFitter::learn(const Vec3& response, double force_n, double dt_s) {
  if (!touching_) {
    mean_response_ = response;
    mean_force_n_ = force_n;
  }
  mean_response_ += low_pass_share(dt_s, kMean_s) * (response - mean_response_);
  mean_force_n_ += low_pass_share(dt_s, kMean_s) * (force_n - mean_force_n_);
  const Vec3 varies = response - mean_response_;
  const double keeps = 1 - low_pass_share(dt_s, kMemory_s), rows = dt_s / 0.001;
  responses_ = keeps * responses_ + rows * varies * varies.transpose();
  forces_ = keeps * forces_ + rows * (force_n - mean_force_n_) * varies;
}

// (G + P) theta = r + P theta_0 by coordinate descent with theta >= 0.
void ContactModelFitter::solve() {
  until_solved_s_ = kSolve_s;
  const Vec3 scale(1, kPriorRate, kPriorRate * kPriorRate);
  const Vec3 weight = kPriorRows * kPriorWay_m * kPriorWay_m * scale.cwiseProduct(scale);
  const Eigen::Matrix3d a = responses_ + Eigen::Matrix3d(weight.asDiagonal());
  const Vec3 b = forces_ + weight.cwiseProduct(Vec3(tissue_.stiffness_n_per_m, 0, 0));
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int i = 0; i < 3; ++i) theta_[i] = std::max(0.0, theta_[i] + (b[i] - a.row(i).dot(theta_)) / a(i, i));
}

}  // namespace sectio
