// Tells whether a hand is being shaken by the force that it feels, by the energy that it receives: while it stays in
// touch, by what is as fast as the device's resonance on the tissue, or faster; when it is thrown out of the tissue, by
// all since it touched. A slow hand behind a delay receives energy, too, since the force lags behind it; but its motion
// is its own.
#pragma once

#include <utility>

#include "common/math/low_pass.h"
#include "common/math/types.h"

namespace sectio {

class ShakeGauge {
 public:
  struct Tick {
    double step_s;
    Vec3 way_m;    // the tip has gone, relative to the tissue
    Vec3 force_n;  // in the middle of the tick
    bool touches;
    double resonance_rad_per_s;
  };
  // True once the hand has been given too much; then the gauge begins anew.
  bool is_shaken(const Tick& tick) {
    if (!(tick.step_s > 0 && tick.resonance_rad_per_s > 0)) return false;
    const double share = low_pass_share(tick.step_s, 1 / tick.resonance_rad_per_s);
    const Vec3 velocity_m_per_s = tick.way_m / tick.step_s;
    given_j_ += tick.step_s * velocity_.fast(velocity_m_per_s, share).dot(force_.fast(tick.force_n, share));
    since_touch_j_ += tick.force_n.dot(tick.way_m);
    if (std::exchange(touches_, tick.touches) && !tick.touches) given_j_ += std::exchange(since_touch_j_, 0);
    given_j_ -= low_pass_share(tick.step_s, kForgets_s) * given_j_;
    const bool shaken = given_j_ > kShaken_j;
    if (shaken) given_j_ = 0;
    return shaken;
  }

 private:
  static constexpr double kForgets_s = 5;
  static constexpr double kShaken_j = 3e-4;

  // A high-pass filter of the second order, the same for force and motion, so that it changes no phase between them.
  struct HighPass {
    Vec3 slow = Vec3::Zero(), slower = Vec3::Zero();

    Vec3 fast(const Vec3& x, double share) {
      slow += share * (x - slow);
      const Vec3 rest = x - slow;
      slower += share * (rest - slower);
      return rest - slower;
    }
  };

  HighPass velocity_, force_;
  bool touches_ = false;
  double since_touch_j_ = 0, given_j_ = 0;
};

}  // namespace sectio
