#include "device_bridge/servo/servo_state.h"

#include <algorithm>

namespace sectio {
namespace {

constexpr double kShareOfBound = 0.7;

Vec3 limited(const Vec3& force_n, double most_n) {
  const double length_n = force_n.norm();
  return length_n > most_n ? Vec3(force_n * (most_n / length_n)) : force_n;
}

// The tissue that a model tells of is where the hand was. A model of too long ago counts as silence, however promptly
// it has come; one of a time that is still to come was never made from this hand's poses.
bool is_timely(const ContactModel& model, double now_s) {
  constexpr double kOldest_s = 0.25, kAhead_s = 0.001;
  const double age_s = now_s - model.tool_time_s;
  return age_s <= kOldest_s && age_s >= -kAhead_s;
}

}  // namespace

ServoRecord ServoState::tick(double now_s, const Pose& pose_world, const ContactModel* model) {
  if (model != nullptr && is_timely(*model, now_s)) follower_.receive(within_limits(*model));
  const double dt = rested_ ? 0 : now_s - last_s_;
  const double way_m = rested_ ? 0 : (pose_world.position_m - last_position_m_).norm();
  const Vec3 velocity = filtered_velocity(now_s, pose_world.position_m);

  ServoRecord record;
  record.sample = {++sequence_, now_s, pose_world, 0};
  if (follower_.silent(now_s)) guard_ = PassivityGuard(spec_.guard);  // its return is a new beginning
  const double most_n = spec_.device.largest_force_n;
  const Vec3 modelled = limited(follower_.tick(pose_world.position_m, velocity, now_s), most_n);
  const Vec3 guarded = guard_.tick(pose_world.position_m, velocity, dt, follower_.model(), modelled);
  const bool finite = guarded.allFinite();
  if (!finite) {
    follower_ = {};
    guard_ = PassivityGuard(spec_.guard);
  }
  const Vec3 wanted = finite ? limited(guarded, most_n) : Vec3(Vec3::Zero());
  const double most_change_n = spec_.device.slew_n_per_s * dt + stiffest_n_per_m() * way_m;
  record.force_world_n = last_force_n_ + limited(wanted - last_force_n_, most_change_n);
  last_force_n_ = record.force_world_n;
  if (const ContactModel* used = follower_.model()) {
    record.model_age_s = now_s - used->tool_time_s;
    record.state = used->state;
    record.server_silent = follower_.silent(now_s);
  }
  return record;
}

// A sampled spring feeds no energy to the hand while its stiffness is below 2 b / T (Colgate & Schenkel 1997).
double ServoState::stiffest_n_per_m() const {
  return kShareOfBound * 2 * spec_.device.damping_n_s_per_m * spec_.device.rate_hz;
}

ContactModel ServoState::within_limits(ContactModel model) const {
  model.stiffness_n_per_m = std::min(model.stiffness_n_per_m, stiffest_n_per_m());
  model.tangential_stiffness_n_per_m = std::min(model.tangential_stiffness_n_per_m, stiffest_n_per_m());
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
