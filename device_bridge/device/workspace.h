// From the room in which a device's handle moves to the world of the scene. A device has its own axes: x to the right
// of the person who holds it, y away from this person, z up. The place of the handle at first is `at_world_m`; from
// there on the instrument moves as the handle does, `scale` times as far. While the clutch is down the instrument stays
// where it is, and afterwards goes on from there.
#pragma once

#include <optional>

#include "common/math/types.h"
#include "device_bridge/device/device.h"

namespace sectio {

struct Workspace {
  double scale = 1;        // way of the instrument over way of the handle
  double force_scale = 1;  // force on the hand over force on the instrument
  Vec3 at_world_m = Vec3::Zero();
  double turn_rad = 0;  // about the vertical: the device's y axis is there in the world, counted from the world's y
  double roll_rad = 0;  // about the instrument's shaft
};

// The limits of a device, as they are where its instrument is: a hand moves `scale` times the way there, against
// 1/`force_scale` of the force.
DeviceLimits limits_at_instrument(const DeviceLimits& device, const Workspace& workspace);

// One thread; no allocation, no lock.
class WorkspaceMap {
 public:
  explicit WorkspaceMap(const Workspace& workspace);

  // The instrument's pose, from that of the handle in the device's axes: z up the shaft, x where the sharp edge is.
  Pose to_world(const Pose& handle, bool clutch);
  // The hand's share of a force or of a moment on the instrument, in the device's axes. Nothing while the clutch is
  // down.
  Vec3 to_hand(const Vec3& on_instrument_world) const;
  // The next pose is where the first one was: a device that was lost doesn't bring its instrument back inside of
  // tissue.
  void begin_anew();

  Vec3 turned_to_world(const Vec3& device) const { return turn_ * device; }

 private:
  Workspace workspace_;
  Eigen::Quaterniond turn_, roll_;
  std::optional<Vec3> anchor_m_;  // place of the handle where the instrument is at `at_world_m_`
  Vec3 at_world_m_;
  Vec3 last_world_m_;
  bool clutch_ = false;
};

}  // namespace sectio
