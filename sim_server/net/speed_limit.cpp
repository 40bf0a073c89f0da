#include "sim_server/net/speed_limit.h"

#include <algorithm>

namespace sectio {

Pose SpeedLimit::follow(const ToolSample& sample, double now_s) {
  if (!any_ || sample.source != source_) {
    any_ = true;
    source_ = sample.source;
    pose_ = sample.pose_world;
    last_s_ = now_s;
    saved_s_ = kSaved_s;
    return pose_;
  }
  saved_s_ = std::min(kSaved_s, saved_s_ + now_s - last_s_);
  last_s_ = now_s;
  const Vec3 way_m = sample.pose_world.position_m - pose_.position_m;
  const double turn_rad = pose_.orientation.angularDistance(sample.pose_world.orientation);
  const double needed_s = std::max(way_m.norm() / fastest_m_per_s_, turn_rad / kFastestTurn_rad_per_s);
  if (needed_s <= saved_s_) {
    pose_ = sample.pose_world;
    saved_s_ -= needed_s;
    return pose_;
  }
  const double part = saved_s_ / needed_s;
  pose_.position_m += part * way_m;
  pose_.orientation = pose_.orientation.slerp(part, sample.pose_world.orientation).normalized();
  saved_s_ = 0;
  return pose_;
}

}  // namespace sectio
