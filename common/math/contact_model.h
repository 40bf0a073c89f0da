// The local contact model, which the server sends to the device bridge. Between two models the bridge itself evaluates
// force = model(pose) at 1 kHz (intermediate representation: Adachi et al. 1995, Mark et al. 1996). evaluate() has the
// formula.
#pragma once

#include <cstdint>

#include "common/math/types.h"

namespace sectio {

enum class ContactState : std::uint8_t { free = 0, contact = 1, penetration = 2 };

constexpr double kNeverYieldsN = 1e6;  // ContactModel::yield_n of tissue that the instrument can't break

struct ContactModel {
  std::uint32_t tool_id = 0;
  std::uint64_t sequence = 0;
  double sim_time_s = 0;
  double tool_time_s = 0;  // time stamp, by the bridge's own clock, of the newest tool sample that the server had used
  ContactState state = ContactState::free;
  Vec3 point_world_m = Vec3::Zero();           // on the plane
  Vec3 normal_world = Vec3::UnitZ();           // unit, out of the tissue
  Vec3 velocity_world_m_per_s = Vec3::Zero();  // velocity of the plane
  Vec3 force_world_n = Vec3::Zero();           // on the tool at tip_world_m, at the time of fitting
  Vec3 tip_world_m = Vec3::Zero();             // tool tip for which force_world_n was computed
  double stiffness_n_per_m = 0;                // along the normal
  double tangential_stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double friction = 0;        // Coulomb's coefficient; the contact sticks up to friction x normal force
  double yield_n = 0;         // the tissue breaks at this force: the model's never exceeds it
  double valid_radius_m = 0;  // past this distance from tip_world_m the force is held, then decays
  double time_to_live_s = 0.05;
};

// The force on the tool for a tip at x with velocity v, at a time of the bridge's clock. With n the normal, v_p the
// plane's velocity, (f0, x0) the force and the tip at the fit, k, k_t, c and mu as named above:
//
//   age = min(now - tool_time, time_to_live)          d   = x - v_p age - x0     (the tip, seen from the moving tissue)
//   F_n = max(0, n.f0 - k n.d - c n.(v - v_p))        F_t = f0_t - k_t d_t, |F_t| <= max(mu F_n, |f0_t|)
//
// and |F| <= yield. The bound |f0_t| fades as lifting reduces the normal force, and is zero once the reduction reaches
// the larger of n.f0 and |f0_t|: a lifted tool feels nothing, and a blade pressed only sideways keeps its force.
// A pure function: only ContactModelFollower holds a force or lets it decay. No allocation, no lock.
Vec3 evaluate(const ContactModel& model, const Vec3& tip_world_m, const Vec3& velocity_world_m_per_s, double now_s);

// Carries a point back to the time of the fit with the plane's velocity: x - v_p age.
Vec3 seen_from_tissue(const ContactModel& model, const Vec3& world_m, double now_s);

// Evaluates the models in the 1 kHz loop, with memory. The follower
//  - blends to a new model within kBlend_s without a jump in force, and lets stiffness rise by at most 20 % in 10 ms
//    (a rise at fixed penetration would feed energy to the user), while it may fall at once;
//  - sticks and slips sideways: the spring's anchor is dragged along once the friction bound is reached;
//  - holds the last force outside valid_radius_m and fades it within kDecay_s;
//  - fades the force within kDecay_s when no model has arrived for kSilence_s (the watchdog).
// Deterministic; one thread; no allocation, no lock.
class ContactModelFollower {
 public:
  static constexpr double kBlend_s = 0.008;
  static constexpr double kDecay_s = 0.1;
  static constexpr double kSilence_s = 0.1;
  static constexpr double kStiffnessRisePer10ms = 0.2;

  // Receives the newest model, which takes effect with the next tick().
  void receive(const ContactModel& model);

  // Returns the force at this tick, zero before the first model. `now_s` must ascend.
  Vec3 tick(const Vec3& tip_world_m, const Vec3& velocity_world_m_per_s, double now_s);

  // The model in effect; null before the first one.
  const ContactModel* model() const { return has_model_ ? &model_ : nullptr; }
  bool silent(double now_s) const { return has_model_ && now_s - received_s_ > kSilence_s; }

 private:
  struct Motion {
    Vec3 tip_m;
    Vec3 velocity_m_per_s;
    double now_s;
    double dt_s;
  };
  void adopt(const Motion& motion);
  void blend_from(const Vec3& before_n, const Motion& motion);
  void raise_stiffness(double dt_s);
  void watch_radius(const Motion& motion);
  Vec3 output(const Motion& motion);

  ContactModel next_;
  ContactModel model_;
  bool fresh_ = false;
  bool has_model_ = false;
  bool outside_ = false;
  double last_tick_s_ = 0;
  double received_s_ = 0;
  double left_s_ = 0;  // when the tip left valid_radius_m
  double gap_began_s_ = 0;
  double stiffness_n_per_m_ = 0;  // follows the model's stiffness at a limited rate of rise
  Vec3 slip_m_ = Vec3::Zero();    // displacement of the sideways spring's anchor since the fit
  Vec3 gap_n_ = Vec3::Zero();     // force before the last change of the model minus force after it
  Vec3 held_n_ = Vec3::Zero();
  Vec3 force_n_ = Vec3::Zero();
};

}  // namespace sectio
