#include "render_client/page/pad_hand.h"

#include <algorithm>
#include <cmath>

namespace sectio {

namespace {

constexpr double kAboveTarget_m = 0.05;  // an instrument that isn't there yet appears so high above what is looked at

}  // namespace

void PadHand::tick(double now_s, const std::optional<JointPose>& instrument, const Camera& camera) {
  const double dt_s = last_s_ ? std::clamp(now_s - *last_s_, 0.0, 0.2) : 0;
  last_s_ = now_s;
  const Mat3 axes = level_axes(camera);
  if (!wish_) {
    if (instrument) {
      wish_ = *instrument;
    } else {
      const Vec3 at_m = camera.target_world_m + Vec3(0, 0, kAboveTarget_m);
      wish_ = JointPose{{at_m, Eigen::Quaterniond(axes).normalized()}, kWidest_rad};
    }
  }
  const double share = state_.slow ? kSlow : 1;
  wish_->position_m +=
      share * kSpeed_m_per_s * dt_s * (axes * Vec3(state_.right, state_.away, state_.up).cwiseMax(-1).cwiseMin(1));
  const double turn_rad = share * kTurn_rad_per_s * dt_s;
  wish_->orientation = (wish_->orientation * Eigen::AngleAxisd(turn_rad * state_.roll, Vec3::UnitZ()) *
                        Eigen::AngleAxisd(turn_rad * state_.pitch, Vec3::UnitY()))
                           .normalized();
  const double wanted_rad = state_.closes ? 0 : kWidest_rad, most_rad = kJaws_rad_per_s * dt_s;
  wish_->opening_rad += std::clamp(wanted_rad - wish_->opening_rad, -most_rad, most_rad);
  if (!instrument) return;
  const Vec3 ahead_m = wish_->position_m - instrument->position_m;
  wish_->position_m = instrument->position_m + std::min(1.0, kLeash_m / std::max(ahead_m.norm(), kLeash_m)) * ahead_m;
}

}  // namespace sectio
