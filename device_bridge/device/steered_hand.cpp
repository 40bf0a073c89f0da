#include "device_bridge/device/steered_hand.h"

#include <algorithm>

namespace sectio {

SteeredHand::SteeredHand(std::unique_ptr<Steering> steering, const Workspace& workspace, double fastest_m_per_s)
    : WishedHand(fastest_m_per_s),
      steering_(std::move(steering)),
      scale_(workspace.scale),
      turn_(Eigen::AngleAxisd(workspace.turn_rad, Vec3::UnitZ())) {
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(workspace.roll_rad, Vec3::UnitZ()));
  wish_.now.pose_world = {Pose{workspace.at_world_m, turn_ * roll}, kWidest_rad};
  home_ = wish_.now;
}

Pose SteeredHand::pose_world(double now_s) {
  const std::optional<Step> step = steering_->step(now_s - last_s_);
  lost_ = !step.has_value();
  wish_.fresh = !lost_;
  if (step) move(*step, now_s - last_s_);
  last_s_ = now_s;
  const Pose pose = hand_.pose_world(now_s);
  if (hand_.present()) {
    Vec3& wish_m = wish_.now.pose_world.position_m;
    const Vec3 ahead_m = wish_m - pose.position_m;
    wish_m = pose.position_m + std::min(1.0, kLeash_m / std::max(ahead_m.norm(), kLeash_m)) * ahead_m;
  } else if (lost_) {
    wish_.now = home_;  // it doesn't come back inside of tissue
  }
  return pose;
}

void SteeredHand::move(const Step& step, double dt_s) {
  buttons_ = step.buttons;
  JointPose& wish = wish_.now.pose_world;
  const double share = buttons_.clutch ? kSmallSteps : 1;
  wish.position_m += share * scale_ * (turn_ * step.way_m);
  const Vec3 turn_rad = share * step.turn_rad;
  if (turn_rad.norm() > 0)
    wish.orientation =
        (wish.orientation * Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()))).normalized();
  const double wanted_rad = buttons_.grip ? 0 : kWidest_rad, most_rad = kJaws_rad_per_s * dt_s;
  wish.opening_rad += std::clamp(wanted_rad - wish.opening_rad, -most_rad, most_rad);
}

}  // namespace sectio
