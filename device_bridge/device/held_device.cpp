#include "device_bridge/device/held_device.h"

namespace sectio {

DeviceLimits HeldDevice::limits_of(const Handle& handle, const Workspace& workspace, double most_force_n) {
  DeviceLimits limits = handle.limits();
  limits.largest_force_n = std::min(limits.largest_force_n, most_force_n);
  return limits_at_instrument(limits, workspace);
}

Pose HeldDevice::pose_world(double now_s) {
  heard_ = handle_->latest(state_) || heard_;
  const bool was_lost = lost_;
  lost_ = handle_->lost();
  if (was_lost && !lost_) map_.begin_anew();
  const double wanted_rad = kWidest_rad * (state_.buttons.grip  ? 0
                                           : state_.has_opening ? std::clamp(state_.opening_share, 0.0, 1.0)
                                                                : 1);
  const double most_rad = kJaws_rad_per_s * (now_s - last_s_);
  opening_rad_ += std::clamp(wanted_rad - opening_rad_, -most_rad, most_rad);
  last_s_ = now_s;
  if (!present()) return {};
  return map_.to_world(state_.pose, state_.buttons.clutch);
}

}  // namespace sectio
