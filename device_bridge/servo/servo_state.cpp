#include "device_bridge/servo/servo_state.h"

#include <algorithm>

namespace sectio {
namespace {

constexpr double kShareOfBound = 0.7;

Vec3 limited(const Vec3& force_n, double most_n) {
  const double length_n = force_n.norm();
  return length_n > most_n ? Vec3(force_n * (most_n / length_n)) : force_n;
}

}  // namespace

ServoRecord ServoState::tick(double now_s, const Pose& pose_world, const ContactModel* model) {
  if (model != nullptr) follower_.receive(within_limits(*model));
  const double dt = rested_ ? 0 : now_s - last_s_;
  const Vec3 velocity = filtered_velocity(now_s, pose_world.position_m);

  ServoRecord record;
  record.sample = {++sequence_, now_s, pose_world, 0};
  if (follower_.silent(now_s)) guard_ = PassivityGuard(spec_.guard);  // its return is a new beginning
  const double most_n = spec_.device.largest_force_n;
  const Vec3 modelled = limited(follower_.tick(pose_world.position_m, velocity, now_s), most_n);
  const Vec3 guarded = guard_.tick(pose_world.position_m, velocity, dt, follower_.model(), modelled);
  record.force_world_n =
      last_force_n_ + limited(limited(guarded, most_n) - last_force_n_, spec_.device.slew_n_per_s * dt);
  if (!record.force_world_n.allFinite()) {
    record.force_world_n = Vec3::Zero();
    follower_ = {};
    guard_ = PassivityGuard(spec_.guard);
  }
  last_force_n_ = record.force_world_n;
  if (const ContactModel* used = follower_.model()) {
    record.model_age_s = now_s - used->tool_time_s;
    record.state = used->state;
    record.server_silent = follower_.silent(now_s);
  }
  return record;
}

// A sampled spring feeds no energy to the hand while its stiffness is below 2 b / T (Colgate & Schenkel 1997).
ContactModel ServoState::within_limits(ContactModel model) const {
  const double stiffest_n_per_m = kShareOfBound * 2 * spec_.device.damping_n_s_per_m * spec_.device.rate_hz;
  model.stiffness_n_per_m = std::min(model.stiffness_n_per_m, stiffest_n_per_m);
  model.tangential_stiffness_n_per_m = std::min(model.tangential_stiffness_n_per_m, stiffest_n_per_m);
  return model;
}

void ServoState::rest() {
  const std::uint64_t sequence = sequence_ + 1;
  *this = ServoState(spec_);
  sequence_ = sequence;
  rested_ = true;
}

Vec3 ServoState::filtered_velocity(double now_s, const Vec3& position_world_m) {
  const double dt = now_s - last_s_;
  if (!rested_ && dt > 0) {
    const Vec3 raw = (position_world_m - last_position_m_) / dt;
    velocity_m_per_s_ += (raw - velocity_m_per_s_) * (dt / (dt + spec_.velocity_filter_s));
  }
  rested_ = false;
  last_s_ = now_s;
  last_position_m_ = position_world_m;
  return velocity_m_per_s_;
}

}  // namespace sectio
