// A simulated person holding a simulated haptic device, so that forces change the motion: a mass with damping (the
// device) is drawn along the trace by a spring and damper (arm and hand) that trembles a little.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/math/trace.h"
#include "device_bridge/device/device.h"
#include "device_bridge/device/hand_mass.h"

namespace sectio {

class VirtualHand : public Device {
 public:
  static constexpr double kStep_s = HandMass::kStep_s;

  // The person wants to follow `wish`; not empty. Starts at rest at its first pose.
  explicit VirtualHand(std::vector<TracePoint> wish, const HandSpec& spec = {});

  DeviceLimits limits() const override { return limits_of(spec_); }
  // Integrates up to now in steps of kStep_s. The orientation is that of the wish: only forces are felt, no torques.
  Pose pose_world(double now_s) override;
  double opening_rad(double now_s) const override { return point_at(wish_, now_s).opening_rad; }
  void apply(const Vec3& force_world_n) override { mass_.apply(force_world_n); }
  bool finished(double now_s) const override { return now_s > wish_.back().time_s; }

  const Vec3& velocity_world_m_per_s() const { return mass_.velocity_m_per_s(); }

 private:
  struct Wave {
    double frequency_rad_per_s;
    double phase_rad;
  };
  Vec3 wish_m(double time_s) const;
  void step();

  HandSpec spec_;
  std::vector<TracePoint> wish_;
  std::array<std::array<Wave, 3>, 3> tremor_;  // axis, wave
  std::int64_t steps_ = 0;
  HandMass mass_;
};

}  // namespace sectio
