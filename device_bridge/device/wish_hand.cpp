#include "device_bridge/device/wish_hand.h"

#include <algorithm>
#include <cmath>

namespace sectio {

Pose WishHand::pose_world(double now_s) {
  if (source_.latest_wish(wish_)) {
    heard_s_ = now_s;
    if (wish_.held && !present_) {  // it appears where it is wanted
      followed_ = wish_.pose_world;
      mass_ = HandMass(spec_, followed_.position_m);
    }
    present_ = wish_.held;
  }
  if (now_s - heard_s_ > kSilence_s) present_ = false;
  const auto due = static_cast<std::int64_t>(std::floor(now_s / HandMass::kStep_s + 1e-6));
  for (; steps_ < due; ++steps_)
    if (present_) step();
  return {mass_.position_m(), followed_.orientation};
}

void WishHand::step() {
  const JointPose& wish = wish_.pose_world;
  const Vec3 before_m = followed_.position_m, way_m = wish.position_m - before_m;
  const double most_m = fastest_m_per_s_ * HandMass::kStep_s;
  followed_.position_m += std::min(1.0, most_m / std::max(way_m.norm(), most_m)) * way_m;
  const double turn_rad = followed_.orientation.angularDistance(wish.orientation);
  const double most_rad = kFastestTurn_rad_per_s * HandMass::kStep_s;
  followed_.orientation =
      followed_.orientation.slerp(std::min(1.0, most_rad / std::max(turn_rad, most_rad)), wish.orientation)
          .normalized();
  followed_.opening_rad += std::clamp(wish.opening_rad - followed_.opening_rad, -most_rad, most_rad);
  mass_.step(before_m, followed_.position_m);
}

}  // namespace sectio
