#include "device_bridge/device/virtual_hand.h"

#include <cmath>
#include <numbers>

#include "common/math/hash.h"

namespace sectio {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

double uniform(std::uint64_t seed, std::uint64_t index) {
  return static_cast<double>(hash_combine(seed, index) >> 11) * 0x1p-53;
}

}  // namespace

VirtualHand::VirtualHand(std::vector<TracePoint> wish, const HandSpec& spec) : spec_(spec), wish_(std::move(wish)) {
  std::uint64_t draw = 0;
  for (auto& axis : tremor_) {
    for (Wave& wave : axis) {
      wave.frequency_rad_per_s = kTwoPi * (8 + 4 * uniform(spec_.seed, draw++));
      wave.phase_rad = kTwoPi * uniform(spec_.seed, draw++);
    }
  }
  position_m_ = wish_m(0);
}

Pose VirtualHand::pose_world(double now_s) {
  const auto due = static_cast<std::int64_t>(std::floor(now_s / kStep_s + 1e-6));
  while (steps_ < due) step();
  return {position_m_, pose_at(wish_, now_s).orientation};
}

Vec3 VirtualHand::wish_m(double time_s) const {
  const double amplitude_m = spec_.tremor_m * std::sqrt(2.0 / 3.0);  // three waves with this have the rms asked for
  Vec3 wish = pose_at(wish_, time_s).position_m;
  for (int axis = 0; axis < 3; ++axis) {
    for (const Wave& wave : tremor_[axis]) {
      wish[axis] += amplitude_m * std::sin(wave.frequency_rad_per_s * time_s + wave.phase_rad);
    }
  }
  return wish;
}

// m dv/dt = F + K (w - x) + B (dw/dt - v) - b v, dampers implicit: stable for any B + b.
void VirtualHand::step() {
  const double h = kStep_s;
  const double t = static_cast<double>(steps_) * h;
  const Vec3 wish = wish_m(t);
  const Vec3 wish_velocity = (wish_m(t + h) - wish) / h;
  const Vec3 drive =
      force_n_ + spec_.hand_stiffness_n_per_m * (wish - position_m_) + spec_.hand_damping_n_s_per_m * wish_velocity;
  const double damping = spec_.device_damping_n_s_per_m + spec_.hand_damping_n_s_per_m;
  velocity_m_per_s_ = (spec_.device_mass_kg * velocity_m_per_s_ + h * drive) / (spec_.device_mass_kg + h * damping);
  position_m_ += h * velocity_m_per_s_;
  ++steps_;
}

}  // namespace sectio
