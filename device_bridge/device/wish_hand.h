// The hand of somebody who has no device: a mouse, a pad or a tracker says where the instrument should be, as often as
// it can, and the mass of HandMass follows at 1 kHz. A wish that jumps is followed no faster than hands move, and the
// instrument stops there: one that swung past would stab. When the instrument is let go, or no wish has come for
// kWishSilence_s, it is drawn out along its shaft with open jaws, and is gone.
#pragma once

#include <cstdint>
#include <optional>

#include "device_bridge/device/device.h"
#include "device_bridge/device/hand_mass.h"

namespace sectio {

struct HandWish {
  JointPose pose_world;
  bool held = true;  // false: the instrument has been let go
};

// The source of wishes. Called by the servo thread only; neither allocates, locks nor waits.
class WishSource {
 public:
  virtual ~WishSource() = default;
  // True when a newer wish has come since the last call; otherwise `wish` stays as it is.
  virtual bool latest_wish(HandWish& wish) = 0;
};

class WishHand : public Device {
 public:
  static constexpr double kAway_m = 0.15;  // how far an instrument is drawn out
  static constexpr double kAway_m_per_s = 0.3;
  static constexpr double kOpen_rad = 0.6;
  static constexpr double kSameHand_m = 0.02;  // a wish so near takes up an instrument that is being drawn out
  static constexpr double kFastestTurn_rad_per_s = 20;

  // The source outlives the hand.
  WishHand(WishSource& source, double fastest_m_per_s, const HandSpec& spec = hand_without_swing())
      : source_(source), fastest_m_per_s_(fastest_m_per_s), spec_(spec) {}

  DeviceLimits limits() const override { return limits_of(spec_); }
  Pose pose_world(double now_s) override;
  double opening_rad(double) const override { return followed_.opening_rad; }
  void apply(const Vec3& force_world_n) override { mass_.apply(force_world_n); }
  bool present() const override { return present_; }
  bool finished(double) const override { return false; }

 private:
  void hear(const HandWish& wish, double now_s);
  void leave();
  void step();

  WishSource& source_;
  double fastest_m_per_s_;
  HandSpec spec_;
  JointPose target_;
  double heard_s_ = 0;
  bool present_ = false;
  bool leaves_ = false;
  std::int64_t steps_ = 0;
  JointPose followed_;  // the wish, at the speed of a hand
  HandMass mass_;
};

}  // namespace sectio
