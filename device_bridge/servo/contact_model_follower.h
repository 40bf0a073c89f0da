// The force on a hand from the newest contact model, at the rate of the device. With f the force that the model tells
// for the hand's sample i, and Y the model's response to the hand's own motion,
//
//   F_n = max(0, Y(now) + w),   w follows n.f - Y(i) within tau        (a predictor: only a *change* within the delay
//                                                                       can be wrong, not the force)
//
// Sideways the tissue is a spring from an anchor, which is dragged along where friction yields. The front of a cut is a
// spring, too, from which a blade can go back freely, and which yields where the blade goes on: as in the simulation
// (sim_server/world/blade_front.h). Both are passive by themselves, and corrected slowly. A thing that jaws hold is at
// the end of a spring whose anchor goes with it; the anchor follows what the models tell slowly, too.
//
// A sampled response gives no energy while k T/2 + c < b, the device's damping (Colgate & Schenkel 1997): Y is bounded
// by that. With dk the stiffness that Y lacks, the loop through a wire has the gain |dk / (1 + j w tau)| / |Z|, and Z,
// the device's mass on the tissue, is least at its resonance, b sqrt(k / m). Below 1 there, no delay gives energy to
// the hand. If dk > k, the gain is above 1 for slow motion, too: tau is dk/k times the delay then. All of it is bounded
// by the device's figures, whatever a server sends.
#pragma once

#include <array>
#include <cstddef>

#include "common/math/contact_model.h"
#include "device_bridge/device/device.h"

namespace sectio {

inline Vec3 limited(const Vec3& v, double longest) {
  const double length = v.norm();
  return length > longest ? Vec3(v * (longest / length)) : v;
}

// Deterministic; one thread; no allocation, no lock.
class ContactModelFollower {
 public:
  static constexpr double kDecay_s = 0.1;
  static constexpr double kSilence_s = 0.1;
  static constexpr double kReturn_s = 0.08;  // in which the force comes back after a silence

  explicit ContactModelFollower(const DeviceLimits& device) : device_(device) {}

  // Takes the newest model, which takes effect with the next tick(), if it answers a sample that this hand had in the
  // last kHistory ticks.
  void receive(const ContactModel& model);
  // The age of the last model that came when that was too old to be felt, until one comes that isn't; else 0.
  double too_old_s() const { return too_old_s_; }

  // Returns the force at this tick, zero before the first model. `now_s` must ascend. No model for kSilence_s: the
  // force fades within kDecay_s (the watchdog). `is_held`: the hand's own damping counts.
  Vec3 tick(double now_s, const Vec3& tip_world_m, bool is_held);

  // The model in effect, within the device's bounds; null before the first one.
  const ContactModel* model() const { return has_model_ ? &model_ : nullptr; }
  const TipMotion& tip() const { return tip_; }
  bool silent(double now_s) const { return has_model_ && now_s - received_s_ > kSilence_s; }
  // A spring that is sampled gives no energy below 2 b / T.
  double stiffest_n_per_m(double damping_n_s_per_m) const;

 private:
  static constexpr std::size_t kHistory = 512;
  struct Felt {
    TipMotion tip;
    Vec3 spring_n = Vec3::Zero();  // force of the spring at the anchor
  };
  const Felt* felt_at(double time_s) const;
  void adopt(bool is_held);
  Vec3 push(double dt_s);
  Vec3 drag(const Vec3& push_n, double dt_s);
  Vec3 hold_blade(double dt_s);
  void hang(const Felt& then, double damping_n_s_per_m);
  Vec3 hold_grip(double dt_s);
  Vec3 went_m(double dt_s) const;

  DeviceLimits device_;
  ContactModel next_, model_;
  bool fresh_ = false, has_model_ = false;
  double received_s_ = 0;
  double too_old_s_ = 0;
  double audible_ = 1;  // share of the force, which a silence takes away
  TipMotion tip_;
  std::array<Felt, kHistory> history_{};  // samples of the last ticks
  std::size_t ticks_ = 0;
  double filter_s_ = 0, side_filter_s_ = 0;  // tau
  double wrong_n_ = 0, correction_n_ = 0;    // n.f - Y(i), and w
  Vec3 side_wrong_n_ = Vec3::Zero(), side_correction_n_ = Vec3::Zero();
  Vec3 anchor_m_ = Vec3::Zero();
  Vec3 told_anchor_m_ = Vec3::Zero();  // the anchor of what jaws hold, by the newest model
  double grip_n_per_m_ = 0;            // its spring; 0: none yet
};

}  // namespace sectio
