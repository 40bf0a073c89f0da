// A device whose handle a person holds, and which may push the hand: the instrument is where the handle is. A driver
// measures the handle (device_bridge/drivers); this maps it to the world of the scene.
#pragma once

#include <algorithm>
#include <memory>

#include "device_bridge/device/workspace.h"

namespace sectio {

// The state of a handle as a driver has measured it, in the axes of the device (workspace.h).
struct HandleState {
  Pose pose;                 // z up the shaft of the instrument
  double opening_share = 1;  // opening of the joint, 1: wide open; only of a device that has one
  bool has_opening = false;
  Buttons buttons;
};

// Used by the servo thread only; no call allocates, locks or waits for another thread.
class Handle {
 public:
  virtual ~Handle() = default;
  virtual DeviceLimits limits() const { return {}; }
  // True when there is a newer state than at the last call; otherwise `state` stays as it is.
  virtual bool latest(HandleState& state) = 0;
  // Sets the force and the moment on the hand, in the axes of the device.
  virtual void apply(const Vec3& force_n, const Vec3& moment_n_m) = 0;
  virtual bool lost() const = 0;
};

class HeldDevice : public Device {
 public:
  static constexpr double kWidest_rad = 0.6;  // angle of jaws that a button closes
  static constexpr double kJaws_rad_per_s = 3;

  // A force limit below the device's own may be asked for.
  HeldDevice(std::unique_ptr<Handle> handle, const Workspace& workspace, double most_force_n)
      : handle_(std::move(handle)), map_(workspace), limits_(limits_of(*handle_, workspace, most_force_n)) {}

  DeviceLimits limits() const override { return limits_; }
  Pose pose_world(double now_s) override;
  double opening_rad(double) const override { return opening_rad_; }
  Buttons buttons() const override { return state_.buttons; }
  void apply(const Vec3& force_world_n) override { force_n_ = map_.to_hand(force_world_n); }
  // Comes after apply(): force and moment go to the device together.
  void apply_moment(const Vec3& moment_world_n_m) override { handle_->apply(force_n_, map_.to_hand(moment_world_n_m)); }
  bool present() const override { return heard_ && !lost_; }
  DeviceStatus status() const override { return lost_ ? DeviceStatus::lost : DeviceStatus::ready; }
  bool finished(double) const override { return false; }

 private:
  static DeviceLimits limits_of(const Handle& handle, const Workspace& workspace, double most_force_n);

  std::unique_ptr<Handle> handle_;
  WorkspaceMap map_;
  DeviceLimits limits_;
  HandleState state_;
  Vec3 force_n_ = Vec3::Zero();
  double opening_rad_ = kWidest_rad;
  double last_s_ = 0;
  bool heard_ = false, lost_ = false;
};

}  // namespace sectio
