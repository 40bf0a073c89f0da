#include "device_bridge/servo/servo_state.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kShaken_s = 10;  // for so long the bounds assume that a hand adds no damping of its own

}  // namespace

ServoRecord ServoState::tick(double now_s, const Pose& pose_world, const ContactModel* model) {
  if (model != nullptr) follower_.receive(*model);
  const double dt = rested_ ? 0 : now_s - last_s_;
  const Vec3 way_m = rested_ ? Vec3(Vec3::Zero()) : Vec3(pose_world.position_m - last_position_m_);
  rested_ = false;
  last_s_ = now_s;
  last_position_m_ = pose_world.position_m;

  ServoRecord record;
  record.sample = {++sequence_, now_s, pose_world, 0};
  Vec3 wanted_n = follower_.tick(now_s, pose_world.position_m, now_s >= is_shaken_until_s_);
  if (!wanted_n.allFinite()) {
    follower_ = ContactModelFollower(device_);
    wanted_n.setZero();
  }
  const double most_change_n =
      device_.slew_n_per_s * dt + follower_.stiffest_n_per_m(device_.damping_n_s_per_m) * way_m.norm();
  record.force_world_n =
      last_force_n_ + limited(limited(wanted_n, device_.largest_force_n) - last_force_n_, most_change_n);
  record.too_old_s = follower_.too_old_s();
  if (const ContactModel* used = follower_.model()) {
    record.model_age_s = now_s - used->tool_time_s;
    record.state = used->state;
    record.server_silent = follower_.silent(now_s);
    record.moment_world_n_m = limited(used->lever_world_m.cross(record.force_world_n), device_.largest_moment_n_m);
    const Vec3 beside_tissue_m = way_m - dt * used->velocity_world_m_per_s;  // tissue that breathes may push
    const double stiffness_n_per_m = std::max(used->stiffness_n_per_m, used->side_stiffness_n_per_m);
    const bool touches = used->state >= ContactState::penetration || dent_of(*used, follower_.tip()).depth_m > 0;
    if (gauge_.is_shaken({dt, beside_tissue_m, 0.5 * (last_force_n_ + record.force_world_n), touches,
                          std::sqrt(stiffness_n_per_m / device_.mass_kg)}))
      is_shaken_until_s_ = now_s + kShaken_s;
  }
  last_force_n_ = record.force_world_n;
  return record;
}

void ServoState::rest() {
  const std::uint64_t sequence = sequence_ + 1;
  *this = ServoState(device_);
  sequence_ = sequence;
  rested_ = true;
}

}  // namespace sectio
