#include "device_bridge/device/tracked_hand.h"

namespace sectio {

Pose TrackedHand::pose_world(double now_s) {
  heard_ = handle_->latest(state_) || heard_;
  buttons_ = state_.buttons;
  const bool was_lost = lost_;
  lost_ = handle_->lost();
  if (was_lost && !lost_) map_.begin_anew();
  wish_.fresh = heard_ && !lost_;
  if (wish_.fresh)
    wish_.now.pose_world = {map_.to_world(state_.pose, buttons_.clutch), buttons_.grip ? 0 : HeldDevice::kWidest_rad};
  return hand_.pose_world(now_s);
}

}  // namespace sectio
