// The filter between what a hand wants and where its instrument is, the same for every device: a mass with damping (the
// device) is drawn along a wish by a spring and damper (arm and hand), and tissue pushes it back.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/math/types.h"
#include "device_bridge/device/device.h"

namespace sectio {

struct HandSpec {
  double device_mass_kg = 0.1;
  double device_damping_n_s_per_m = 0.5;
  double hand_stiffness_n_per_m = 450;  // people: 200 to 700
  double hand_damping_n_s_per_m = 4;    // people: 2 to 5
  double tremor_m = 1e-4;               // tremor of a simulated hand: rms of each axis, between 8 and 12 Hz
  std::uint64_t seed = 1;
};

// The hand of somebody whose wish jumps from place to place: it goes there without going past it, since all of its
// damping works against its own motion, none against that of the wish. Critical: b = 2 sqrt(K m).
inline HandSpec hand_without_swing() {
  HandSpec spec;
  spec.device_damping_n_s_per_m = 2 * std::sqrt(spec.hand_stiffness_n_per_m * spec.device_mass_kg);
  spec.hand_damping_n_s_per_m = 0;
  return spec;
}

// The hand of somebody whose device says where it is, smoothly: it is there without a lag. The same damping works
// against the motion relative to the wish's.
inline HandSpec hand_without_lag() {
  HandSpec spec;
  spec.hand_damping_n_s_per_m =
      2 * std::sqrt(spec.hand_stiffness_n_per_m * spec.device_mass_kg) - spec.device_damping_n_s_per_m;
  return spec;
}

// Bounds of a force that are made of these count on kHandDamping_n_s_per_m of the hand.
inline DeviceLimits limits_of(const HandSpec& spec) {
  const double lacks_n_s_per_m = std::max(0.0, kHandDamping_n_s_per_m - spec.hand_damping_n_s_per_m);
  return {.damping_n_s_per_m = spec.device_damping_n_s_per_m - lacks_n_s_per_m, .mass_kg = spec.device_mass_kg};
}

// No allocation, no lock; one thread.
class HandMass {
 public:
  static constexpr double kStep_s = 0.001;

  HandMass() = default;
  HandMass(const HandSpec& spec, const Vec3& position_m) : spec_(spec), position_m_(position_m) {}

  // Goes on by kStep_s, while the wish moves from `wish_m` to `next_wish_m`.
  void step(const Vec3& wish_m, const Vec3& next_wish_m);
  void apply(const Vec3& force_n) { force_n_ = force_n; }

  const Vec3& position_m() const { return position_m_; }
  const Vec3& velocity_m_per_s() const { return velocity_m_per_s_; }

 private:
  HandSpec spec_;
  Vec3 position_m_ = Vec3::Zero();
  Vec3 velocity_m_per_s_ = Vec3::Zero();
  Vec3 force_n_ = Vec3::Zero();
};

}  // namespace sectio
