// A device that a hand holds: it measures a pose and takes a force. Each device has a pair of files of its own.
#pragma once

#include "common/math/types.h"

namespace sectio {

// Limits of a device, which bound all that its hand may feel, whatever a server sends.
struct DeviceLimits {
  double damping_n_s_per_m = 0.5;  // of the device itself when no hand holds it
  double mass_kg = 0.1;            // that a hand moves with it
  double largest_force_n = 10;
  double slew_n_per_s = 500;  // the fastest change of its force while the hand rests
  double rate_hz = 1000;      // of the loop that drives it
};

// Used by the servo thread only; neither call allocates, locks or waits.
class Device {
 public:
  virtual ~Device() = default;

  virtual DeviceLimits limits() const { return {}; }

  // The instrument's pose at a time since the loop began; times ascend.
  virtual Pose pose_world(double now_s) = 0;

  // Between the blades of an instrument with a joint, at the same time.
  virtual double opening_rad(double) const { return 0; }

  // The force on the hand from now on, until the next call.
  virtual void apply(const Vec3& force_world_n) = 0;
  // Likewise the moment about the origin of the tool's frame, of a device that can turn the hand.
  virtual void apply_moment(const Vec3& /*moment_world_n_m*/) {}

  // False while nobody holds the instrument: then it isn't shown to the server.
  virtual bool present() const { return true; }

  // True when there is nothing more to play; a real device never finishes.
  virtual bool finished(double now_s) const = 0;
};

}  // namespace sectio
