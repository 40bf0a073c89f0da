// A handle behind a library whose calls may wait for the device: a thread of its own exchanges force for pose, as fast
// as the library does. When the servo has given no force for a while the hand gets none.
#pragma once

#include <atomic>

#include "common/core/latest_value.h"
#include "common/core/wall_time.h"
#include "device_bridge/device/held_device.h"

namespace sectio {

struct HandLoad {
  Vec3 force_n = Vec3::Zero(), moment_n_m = Vec3::Zero();  // in the axes of the device
  double given_s = -1e300;
};

class PolledHandle : public Handle {
 public:
  static constexpr double kSilence_s = 0.1;  // silence of the device before it is lost
  static constexpr double kStale_s = 0.05;   // a force of the servo older than this is stale

  bool latest(HandleState& state) override { return states_.load(state); }
  void apply(const Vec3& force_n, const Vec3& moment_n_m) override {
    loads_.store({force_n, moment_n_m, steady_now_s()});
  }
  bool lost() const override { return steady_now_s() - heard_s_ > kSilence_s; }

 protected:
  // Called by the thread that talks to the library.
  void heard(const HandleState& state) {
    states_.store(state);
    heard_s_ = steady_now_s();
  }
  const HandLoad& load_now() {
    loads_.load(load_);
    if (steady_now_s() - load_.given_s > kStale_s) load_ = {};
    return load_;
  }

 private:
  LatestValue<HandleState> states_;
  LatestValue<HandLoad> loads_;
  HandLoad load_;
  std::atomic<double> heard_s_{-1e300};
};

}  // namespace sectio
