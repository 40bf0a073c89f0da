// A device that says where its hand wants to be and can't push: what it says becomes a wish, along which the mass of
// WishHand is drawn. A class for each kind of device writes the wish in pose_world().
#pragma once

#include "device_bridge/device/wish_hand.h"

namespace sectio {

class WishedHand : public Device {
 public:
  explicit WishedHand(double fastest_m_per_s, const HandSpec& spec = hand_without_swing())
      : hand_(wish_, fastest_m_per_s, spec) {}

  DeviceLimits limits() const override { return hand_.limits(); }
  double opening_rad(double now_s) const override { return hand_.opening_rad(now_s); }
  Buttons buttons() const override { return buttons_; }
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

 protected:
  Wish wish_;
  WishHand hand_;
  Buttons buttons_;
  bool lost_ = false;
};

}  // namespace sectio
