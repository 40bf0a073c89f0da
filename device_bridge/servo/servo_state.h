// One tick of the haptic loop as plain arithmetic: pose in, force out. No clock, thread, device or wire.
#pragma once

#include <cstdint>

#include "common/math/types.h"
#include "device_bridge/device/device.h"
#include "device_bridge/servo/contact_model_follower.h"
#include "device_bridge/servo/shake_gauge.h"

namespace sectio {

// The instrument as the server is told of it, once a tick.
struct PoseSample {
  std::uint64_t sequence = 0;  // from 1, without holes while the instrument is held
  double tool_time_s = 0;      // since the loop began
  Pose pose_world;
  double opening_rad = 0;
};

// A tick as the log keeps it.
struct ServoRecord {
  PoseSample sample;
  Vec3 force_world_n = Vec3::Zero();
  Vec3 moment_world_n_m = Vec3::Zero();  // about the origin of the tool's frame
  double model_age_s = -1;               // now - the model's tool time; negative: no model yet
  ContactState state = ContactState::free;
  bool server_silent = false;  // the watchdog controls the force
  double too_old_s = 0;        // models come, and are so old that the hand doesn't feel them; else 0
  std::uint64_t overruns = 0;  // ticks missed so far
  double woke_after_s = 0;     // from the tick's time to when the loop really woke; less than a period
};

class ServoState {
 public:
  explicit ServoState(const DeviceLimits& device = {}) : device_(device), follower_(device) {}

  // `model`: the newest model if one has come since the last tick, else null. The tip is the origin of the tool's
  // frame. A result that isn't finite becomes no force, and the model is forgotten. In any case, the force on a hand at
  // rest changes no faster than the device's slew; its own motion adds what the stiffest spring would.
  ServoRecord tick(double now_s, const Pose& pose_world, const ContactModel* model);

  // A tick at which nobody holds the instrument: the next pose goes on from no other one, which the hole in the
  // sequence says.
  void rest();

 private:
  DeviceLimits device_;
  ContactModelFollower follower_;
  std::uint64_t sequence_ = 0;
  bool rested_ = true;  // no tick before this one
  double last_s_ = 0;
  Vec3 last_position_m_ = Vec3::Zero();
  Vec3 last_force_n_ = Vec3::Zero();
  ShakeGauge gauge_;
  double is_shaken_until_s_ = 0;
};

}  // namespace sectio
