#include "device_bridge/servo/servo_state.h"

namespace sectio {
namespace {

Vec3 limited(const Vec3& force_n, double most_n) {
  const double length_n = force_n.norm();
  return length_n > most_n ? Vec3(force_n * (most_n / length_n)) : force_n;
}

}  // namespace

ServoRecord ServoState::tick(double now_s, const Pose& pose_world, const ContactModel* model) {
  if (model != nullptr) follower_.receive(*model);
  const double dt = sequence_ > 0 ? now_s - last_s_ : 0;
  const Vec3 velocity = filtered_velocity(now_s, pose_world.position_m);

  ServoRecord record;
  record.sample = {++sequence_, now_s, pose_world, 0};
  if (follower_.silent(now_s)) guard_ = PassivityGuard(spec_.guard);  // its return is a new beginning
  const Vec3 modelled = limited(follower_.tick(pose_world.position_m, velocity, now_s), spec_.max_force_n);
  const Vec3 guarded = guard_.tick(pose_world.position_m, velocity, dt, follower_.model(), modelled);
  record.force_world_n = limited(guarded, spec_.max_force_n);
  if (!record.force_world_n.allFinite()) {
    record.force_world_n = Vec3::Zero();
    follower_ = {};
    guard_ = PassivityGuard(spec_.guard);
  }
  if (const ContactModel* used = follower_.model()) {
    record.model_age_s = now_s - used->tool_time_s;
    record.state = used->state;
    record.server_silent = follower_.silent(now_s);
  }
  return record;
}

Vec3 ServoState::filtered_velocity(double now_s, const Vec3& position_world_m) {
  const double dt = now_s - last_s_;
  if (sequence_ > 0 && dt > 0) {
    const Vec3 raw = (position_world_m - last_position_m_) / dt;
    velocity_m_per_s_ += (raw - velocity_m_per_s_) * (dt / (dt + spec_.velocity_filter_s));
  }
  last_s_ = now_s;
  last_position_m_ = position_world_m;
  return velocity_m_per_s_;
}

}  // namespace sectio
