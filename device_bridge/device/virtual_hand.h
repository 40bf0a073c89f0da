// A simulated person holding a simulated haptic device, so that forces change the motion: a mass with damping (the
// device) is drawn along the trace by a spring and damper (arm and hand) that trembles a little.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/math/trace.h"
#include "device_bridge/device/device.h"

namespace sectio {

struct HandSpec {
  double device_mass_kg = 0.1;
  double device_damping_n_s_per_m = 0.5;
  double hand_stiffness_n_per_m = 450;  // people: 200 to 700
  double hand_damping_n_s_per_m = 4;    // people: 2 to 5
  double tremor_m = 1e-4;               // rms of each axis, between 8 and 12 Hz
  std::uint64_t seed = 1;
};

class VirtualHand : public Device {
 public:
  static constexpr double kStep_s = 0.001;

  // The person wants to follow `wish`; not empty. Starts at rest at its first pose.
  explicit VirtualHand(std::vector<TracePoint> wish, const HandSpec& spec = {});

  DeviceLimits limits() const override { return {.damping_n_s_per_m = spec_.device_damping_n_s_per_m}; }
  // Integrates up to now in steps of kStep_s. Orientation is the wish's own: only forces are felt, no torques.
  Pose pose_world(double now_s) override;
  double opening_rad(double now_s) const override { return point_at(wish_, now_s).opening_rad; }
  void apply(const Vec3& force_world_n) override { force_n_ = force_world_n; }
  bool finished(double now_s) const override { return now_s > wish_.back().time_s; }

  const Vec3& velocity_world_m_per_s() const { return velocity_m_per_s_; }

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
  Vec3 position_m_;
  Vec3 velocity_m_per_s_ = Vec3::Zero();
  Vec3 force_n_ = Vec3::Zero();
};

}  // namespace sectio
