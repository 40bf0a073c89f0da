#include "common/math/contact_model.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kForceEpsilon_n = 1e-3;  // smaller forces count as no contact

Vec3 clamped(const Vec3& v, double longest) {
  const double length = v.norm();
  return length > longest ? Vec3(v * (longest / length)) : v;
}

// The force, and the part of the sideways force that exceeded the friction bound.
struct Evaluation {
  Vec3 force_n;
  Vec3 cut_off_n;
};

Evaluation evaluate_with(const ContactModel& m, double stiffness_n_per_m, const Vec3& slip_m, const Vec3& tip_world_m,
                         const Vec3& velocity_world_m_per_s, double now_s) {
  const Vec3& n = m.normal_world;
  const Vec3 d = seen_from_tissue(m, tip_world_m, now_s) - m.tip_world_m;
  const double normal_0 = n.dot(m.force_world_n);
  const double risen =
      -stiffness_n_per_m * n.dot(d) - m.damping_n_s_per_m * n.dot(velocity_world_m_per_s - m.velocity_world_m_per_s);
  const double normal = std::max(0.0, normal_0 + risen);

  const Vec3 side_0 = m.force_world_n - normal_0 * n;
  const double scale = std::max({normal_0, side_0.norm(), kForceEpsilon_n});
  const double lifted = std::clamp(1 + risen / scale, 0.0, 1.0);
  const Vec3 side = side_0 - m.tangential_stiffness_n_per_m * (d - n.dot(d) * n - slip_m);
  const Vec3 bounded = clamped(side, std::max(m.friction * normal, side_0.norm() * lifted));
  return {clamped(normal * n + bounded, m.yield_n), side - bounded};
}

}  // namespace

Vec3 seen_from_tissue(const ContactModel& model, const Vec3& world_m, double now_s) {
  const double age_s = std::clamp(now_s - model.tool_time_s, 0.0, model.time_to_live_s);
  return world_m - model.velocity_world_m_per_s * age_s;
}

Vec3 evaluate(const ContactModel& model, const Vec3& tip_world_m, const Vec3& velocity_world_m_per_s, double now_s) {
  return evaluate_with(model, model.stiffness_n_per_m, Vec3::Zero(), tip_world_m, velocity_world_m_per_s, now_s)
      .force_n;
}

void ContactModelFollower::receive(const ContactModel& model) {
  next_ = model;
  fresh_ = true;
}

Vec3 ContactModelFollower::tick(const Vec3& tip_world_m, const Vec3& velocity_world_m_per_s, double now_s) {
  const Motion motion{tip_world_m, velocity_world_m_per_s, now_s, std::max(0.0, now_s - last_tick_s_)};
  last_tick_s_ = now_s;
  if (fresh_) adopt(motion);
  if (!has_model_) return Vec3::Zero();
  raise_stiffness(motion.dt_s);
  watch_radius(motion);
  force_n_ = output(motion);
  return force_n_;
}

void ContactModelFollower::adopt(const Motion& motion) {
  fresh_ = false;
  const bool touching = stiffness_n_per_m_ > 0 && force_n_.norm() > kForceEpsilon_n;
  const Vec3 before_n = has_model_ ? output(motion) : Vec3::Zero();
  model_ = next_;
  stiffness_n_per_m_ = touching ? std::min(stiffness_n_per_m_, model_.stiffness_n_per_m) : model_.stiffness_n_per_m;
  slip_m_ = Vec3::Zero();
  received_s_ = motion.now_s;
  has_model_ = true;
  outside_ = false;
  blend_from(before_n, motion);
}

// Starts a blend of the output from `before_n` to the model's force, which takes kBlend_s.
void ContactModelFollower::blend_from(const Vec3& before_n, const Motion& motion) {
  gap_n_ = Vec3::Zero();
  gap_n_ = before_n - output(motion);
  gap_began_s_ = motion.now_s;
}

void ContactModelFollower::raise_stiffness(double dt_s) {
  const double rise = std::pow(1 + kStiffnessRisePer10ms, dt_s / 0.01);
  stiffness_n_per_m_ = std::min(model_.stiffness_n_per_m, stiffness_n_per_m_ * rise);
}

void ContactModelFollower::watch_radius(const Motion& motion) {
  const Vec3 d = seen_from_tissue(model_, motion.tip_m, motion.now_s) - model_.tip_world_m;
  const bool outside = d.norm() > model_.valid_radius_m;
  if (outside && !outside_) {
    held_n_ = force_n_;
    left_s_ = motion.now_s;
    gap_n_ = Vec3::Zero();
  }
  if (!outside && outside_) {
    outside_ = false;
    blend_from(force_n_, motion);
  }
  outside_ = outside;
}

Vec3 ContactModelFollower::output(const Motion& motion) {
  const double quiet_s = motion.now_s - received_s_ - kSilence_s;
  const double audible = std::clamp(1 - quiet_s / kDecay_s, 0.0, 1.0);
  if (outside_) return audible * std::max(0.0, 1 - (motion.now_s - left_s_) / kDecay_s) * held_n_;

  const Evaluation e =
      evaluate_with(model_, stiffness_n_per_m_, slip_m_, motion.tip_m, motion.velocity_m_per_s, motion.now_s);
  if (model_.tangential_stiffness_n_per_m > 0) slip_m_ += e.cut_off_n * (-1 / model_.tangential_stiffness_n_per_m);
  const double left_to_blend = std::clamp(1 - (motion.now_s - gap_began_s_) / kBlend_s, 0.0, 1.0);
  return audible * (e.force_n + left_to_blend * gap_n_);
}

}  // namespace sectio
