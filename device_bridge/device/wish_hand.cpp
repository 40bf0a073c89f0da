#include "device_bridge/device/wish_hand.h"

#include <algorithm>
#include <cmath>

#include "common/core/hand_silence.h"

namespace sectio {

Pose WishHand::pose_world(double now_s) {
  if (HandWish wish; source_.latest_wish(wish)) hear(wish, now_s);
  if (present_ && now_s - heard_s_ > kWishSilence_s) leave();
  const auto due = static_cast<std::int64_t>(std::floor(now_s / HandMass::kStep_s + 1e-6));
  for (; steps_ < due; ++steps_)
    if (present_) step();
  return {mass_.position_m(), followed_.orientation};
}

void WishHand::hear(const HandWish& wish, double now_s) {
  heard_s_ = now_s;
  if (!wish.held) {
    if (present_) leave();
    return;
  }
  // The next hand may be elsewhere: the instrument doesn't go there through tissue.
  if (leaves_ && (wish.pose_world.position_m - followed_.position_m).norm() > kSameHand_m) return;
  if (!present_) {  // it appears where it is wanted
    followed_ = wish.pose_world;
    mass_ = HandMass(spec_, followed_.position_m);
  }
  present_ = true;
  leaves_ = false;
  target_ = wish.pose_world;
}

void WishHand::leave() {
  if (leaves_) return;
  leaves_ = true;
  followed_.position_m = mass_.position_m();  // not on to where it was wanted
  target_ = followed_;
  target_.position_m += followed_.orientation * Vec3(0, 0, kAway_m);
  target_.opening_rad = std::max(followed_.opening_rad, kOpen_rad);
}

void WishHand::step() {
  const JointPose& wish = target_;
  const Vec3 before_m = followed_.position_m, way_m = wish.position_m - before_m;
  const double most_m = (leaves_ ? kAway_m_per_s : fastest_m_per_s_) * HandMass::kStep_s;
  followed_.position_m += std::min(1.0, most_m / std::max(way_m.norm(), most_m)) * way_m;
  const double turn_rad = followed_.orientation.angularDistance(wish.orientation);
  const double most_rad = kFastestTurn_rad_per_s * HandMass::kStep_s;
  followed_.orientation =
      followed_.orientation.slerp(std::min(1.0, most_rad / std::max(turn_rad, most_rad)), wish.orientation)
          .normalized();
  followed_.opening_rad += std::clamp(wish.opening_rad - followed_.opening_rad, -most_rad, most_rad);
  mass_.step(before_m, followed_.position_m);
  if (leaves_ && way_m.norm() <= most_m) present_ = leaves_ = false;
}

}  // namespace sectio
