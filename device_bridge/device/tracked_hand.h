// The hand of somebody whose device says where it is, and can't push: a tracker, a robot of somebody else. Its place is
// a wish, along which the mass of WishHand is drawn.
#pragma once

#include <memory>

#include "device_bridge/device/held_device.h"
#include "device_bridge/device/wish_hand.h"

namespace sectio {

class TrackedHand : public Device {
 public:
  TrackedHand(std::unique_ptr<Handle> handle, const Workspace& workspace, double fastest_m_per_s)
      : handle_(std::move(handle)), map_(workspace), hand_(wish_, fastest_m_per_s) {}

  DeviceLimits limits() const override { return hand_.limits(); }
  Pose pose_world(double now_s) override;
  double opening_rad(double now_s) const override { return hand_.opening_rad(now_s); }
  Buttons buttons() const override { return state_.buttons; }
  void apply(const Vec3& force_world_n) override { hand_.apply(force_world_n); }
  bool present() const override { return hand_.present(); }
  DeviceStatus status() const override { return lost_ ? DeviceStatus::lost : DeviceStatus::ready; }
  bool finished(double) const override { return false; }

 private:
  struct Wish : WishSource {
    bool latest_wish(HandWish& wish) override {
      if (fresh) wish = now;
      return fresh;
    }
    HandWish now;
    bool fresh = false;
  };

  std::unique_ptr<Handle> handle_;
  WorkspaceMap map_;
  HandleState state_;
  Wish wish_;
  WishHand hand_;
  bool heard_ = false, lost_ = false;
};

}  // namespace sectio
