// A device that a hand holds: it measures a pose and takes a force. Each device has a pair of files of its own.
#pragma once

#include "common/math/types.h"

namespace sectio {

constexpr double kHandDamping_n_s_per_m = 1;  // a hand that holds a device adds this; people have 2 to 5

// Limits of a device, which bound all that its hand may feel, whatever a server sends.
struct DeviceLimits {
  double damping_n_s_per_m = 0.5;  // damping of the device when no hand holds it
  double mass_kg = 0.1;            // mass that a hand moves with the device
  double largest_force_n = 10;
  double slew_n_per_s = 500;  // the fastest change of its force while the hand rests
  double largest_moment_n_m = 1;
  double rate_hz = 1000;  // rate of the loop that drives the device
};

enum class DeviceStatus {
  ready,
  lost,  // nothing is heard of it; it may come back
};

// The two buttons that instruments have a use for, wherever a device has them.
struct Buttons {
  bool clutch = false;  // while it is down the device moves without its instrument
  bool grip = false;    // closes jaws
  bool operator==(const Buttons&) const = default;
};

// Used by the servo thread only; no call allocates, locks or waits.
class Device {
 public:
  virtual ~Device() = default;

  virtual DeviceLimits limits() const { return {}; }

  // The instrument's pose at a time since the loop began; times ascend.
  virtual Pose pose_world(double now_s) = 0;

  // The angle between the blades of an instrument with a joint, at the same time.
  virtual double opening_rad(double) const { return 0; }
  virtual Buttons buttons() const { return {}; }

  // Sets the force on the hand from now on, until the next call.
  virtual void apply(const Vec3& force_world_n) = 0;
  // Sets the moment about the origin of the tool's frame likewise, for a device that can turn the hand.
  virtual void apply_moment(const Vec3& /*moment_world_n_m*/) {}

  // False while nobody holds the instrument: then it isn't shown to the server.
  virtual bool present() const { return true; }
  virtual DeviceStatus status() const { return DeviceStatus::ready; }

  // True when there is nothing more to play; a real device never finishes.
  virtual bool finished(double now_s) const = 0;
};

}  // namespace sectio
