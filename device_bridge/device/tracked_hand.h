// The hand of somebody whose device says where it is, and can't push: a tracker, a robot of somebody else. Its place is
// the wish.
#pragma once

#include <memory>

#include "device_bridge/device/held_device.h"
#include "device_bridge/device/wished_hand.h"

namespace sectio {

class TrackedHand : public WishedHand {
 public:
  TrackedHand(std::unique_ptr<Handle> handle, const Workspace& workspace, double fastest_m_per_s)
      : WishedHand(fastest_m_per_s, hand_without_lag()), handle_(std::move(handle)), map_(workspace) {}

  Pose pose_world(double now_s) override;

 private:
  std::unique_ptr<Handle> handle_;
  WorkspaceMap map_;
  HandleState state_;
  bool heard_ = false;
};

}  // namespace sectio
