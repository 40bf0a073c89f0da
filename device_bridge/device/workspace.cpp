#include "device_bridge/device/workspace.h"

namespace sectio {

DeviceLimits limits_at_instrument(const DeviceLimits& device, const Workspace& workspace) {
  DeviceLimits limits = device;
  const double lighter = 1 / (workspace.scale * workspace.force_scale);
  limits.damping_n_s_per_m *= lighter;
  limits.mass_kg *= lighter;
  limits.largest_force_n /= workspace.force_scale;
  limits.slew_n_per_s /= workspace.force_scale;
  limits.largest_moment_n_m /= workspace.force_scale;
  return limits;
}

WorkspaceMap::WorkspaceMap(const Workspace& workspace)
    : workspace_(workspace),
      turn_(Eigen::AngleAxisd(workspace.turn_rad, Vec3::UnitZ())),
      roll_(Eigen::AngleAxisd(workspace.roll_rad, Vec3::UnitZ())),
      at_world_m_(workspace.at_world_m),
      last_world_m_(workspace.at_world_m) {}

Pose WorkspaceMap::to_world(const Pose& handle, bool clutch) {
  if (!anchor_m_ || (clutch_ && !clutch)) {
    anchor_m_ = handle.position_m;
    at_world_m_ = last_world_m_;
  }
  clutch_ = clutch;
  if (!clutch) last_world_m_ = at_world_m_ + workspace_.scale * turned_to_world(handle.position_m - *anchor_m_);
  return {last_world_m_, (turn_ * handle.orientation * roll_).normalized()};
}

void WorkspaceMap::begin_anew() {
  anchor_m_.reset();
  last_world_m_ = workspace_.at_world_m;
}

Vec3 WorkspaceMap::to_hand(const Vec3& on_instrument_world) const {
  if (clutch_) return Vec3::Zero();
  return workspace_.force_scale * (turn_.conjugate() * on_instrument_world);
}

}  // namespace sectio
