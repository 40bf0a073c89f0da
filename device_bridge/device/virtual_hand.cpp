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
  mass_ = HandMass(spec_, wish_m(0));
}

Pose VirtualHand::pose_world(double now_s) {
  const auto due = static_cast<std::int64_t>(std::floor(now_s / kStep_s + 1e-6));
  while (steps_ < due) step();
  return {mass_.position_m(), pose_at(wish_, now_s).orientation};
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

void VirtualHand::step() {
  const double t = static_cast<double>(steps_) * kStep_s;
  mass_.step(wish_m(t), wish_m(t + kStep_s));
  ++steps_;
}

}  // namespace sectio
