// The hand of somebody with a device that says where to go, not where to be: a pad, a space mouse, a mouse. Its steps
// add up to the wish. The wish never runs away from an instrument that tissue holds up.
#pragma once

#include <memory>
#include <optional>

#include "device_bridge/device/wished_hand.h"
#include "device_bridge/device/workspace.h"

namespace sectio {

// A step of the hand since the last one, in the axes of the device (workspace.h).
struct Step {
  Vec3 way_m = Vec3::Zero();
  Vec3 turn_rad = Vec3::Zero();  // about the instrument's own axes: x where its edge is, z up its shaft
  Buttons buttons;               // clutch: small steps
};

// Used by the servo thread only; no call allocates, locks or waits for another thread.
class Steering {
 public:
  virtual ~Steering() = default;
  // Nothing when the device isn't there.
  virtual std::optional<Step> step(double dt_s) = 0;
};

class SteeredHand : public WishedHand {
 public:
  static constexpr double kLeash_m = 0.03;    // the wish is at most this far from the instrument
  static constexpr double kSmallSteps = 0.2;  // factor of the steps while the clutch is down
  static constexpr double kWidest_rad = 0.6;
  static constexpr double kJaws_rad_per_s = 1.5;

  SteeredHand(std::unique_ptr<Steering> steering, const Workspace& workspace, double fastest_m_per_s);

  Pose pose_world(double now_s) override;

 private:
  void move(const Step& step, double dt_s);

  std::unique_ptr<Steering> steering_;
  double scale_;
  Eigen::Quaterniond turn_;
  HandWish home_;
  double last_s_ = 0;
};

}  // namespace sectio
