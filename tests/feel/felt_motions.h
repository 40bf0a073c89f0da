// The motions and the hands with which the force at a hand is measured.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/feel/felt_loop.h"

namespace sectio::test {

struct Sine {
  double hz, amplitude_m;
};
constexpr std::array<Sine, 5> kSines{{{1, 0.001}, {3, 0.001}, {10, 5e-4}, {30, 3e-4}, {60, 2e-4}}};
constexpr double kSettled_s = 1.5, kSinesFor_s = 3.5;

inline const std::vector<WireSpec> kWires{{0, 0}, {0.025, 0.02}, {0.05, 0.02}};

inline const std::vector<WireSpec> kGripWires{{0, 0}, {0.01, 0}, {0.025, 0.02}, {0.05, 0.02}};

inline const HandSpec kFirmHand{.tremor_m = 0};
inline const HandSpec kTremblingHand{.tremor_m = 1e-4};
inline const HandSpec kWeakHand{.hand_stiffness_n_per_m = 150, .hand_damping_n_s_per_m = 0.5, .tremor_m = 0};

// The lowest point of the ball at a depth beneath the block's top.
inline Pose ball_at(double x_m, double depth_m) {
  return {Vec3(0.001 + x_m, 0.002, kBlockTop_m + kBall_m - depth_m), Eigen::Quaterniond::Identity()};
}

// From 2 mm above down to a depth in 0.3 s, and a sine about it from 0.5 s on.
inline Path pressing(double depth_m, Sine sine) {
  return [=](double t) {
    const double down = std::clamp(t / 0.3, 0.0, 1.0);
    // Less than the depth, so that the ball stays in touch.
    const double amplitude_m = std::min(sine.amplitude_m, 0.5 * depth_m);
    const double phase = 2 * std::numbers::pi * sine.hz * std::max(0.0, t - 0.5);
    return ball_at(0, -0.002 + down * (0.002 + depth_m) + amplitude_m * std::sin(phase));
  };
}

// From 5 mm above down to a depth, and up again.
inline Path tap(double depth_m, double speed_m_per_s) {
  return [=](double t) {
    const double way_m = 0.005 + depth_m;
    const double gone_m = speed_m_per_s * std::max(0.0, t - 0.1);
    return ball_at(0, -0.005 + (gone_m < way_m ? gone_m : std::max(0.0, 2 * way_m - gone_m)));
  };
}

inline Path holding(double depth_m) {
  return [=](double t) { return ball_at(0, -0.002 + std::clamp(t / 0.3, 0.0, 1.0) * (0.002 + depth_m)); };
}

// The same, then 20 mm along the top.
inline Path sliding(double depth_m, double speed_m_per_s) {
  return [=](double t) {
    const double down = std::clamp(t / 0.3, 0.0, 1.0);
    return ball_at(-0.01 + std::clamp(speed_m_per_s * (t - 0.5), 0.0, 0.02), -0.002 + down * (0.002 + depth_m));
  };
}

// The tip of a scalpel goes in by 8 mm within 0.4 s, and 20 mm towards its sharp side.
inline Path cutting(double speed_m_per_s) {
  return [=](double t) {
    const double down = std::clamp(t / 0.4, 0.0, 1.0), along_m = std::clamp(speed_m_per_s * (t - 0.5), 0.0, 0.02);
    return Pose{Vec3(-0.01 + along_m, 0.002, kBlockTop_m + 0.002 - 0.01 * down), Eigen::Quaterniond::Identity()};
  };
}

// The same, for 10 mm; then the blade rests.
inline Path cutting_and_holding() {
  return [cut = cutting(0.02)](double t) { return cut(std::min(t, 1.0)); };
}
inline Scene blade_block(const std::string& model, double young_pa) {
  Scene scene = felt_block(model, young_pa, "scalpel");
  scene.bodies[0].cutting.threshold_force_n = 0.03;
  return scene;
}

// Forceps that go to the top of felt_block(..., "forceps"), close on it, hold still until kLifts_s, and lift.
constexpr double kLifts_s = 2.2, kGripped_s = 1.2, kGripFor_s = 4;
inline Scene gripped_block(const std::string& model, double young_pa) {
  Scene scene = felt_block(model, young_pa, "forceps");
  for (double t = 0; t < kGripFor_s; t += 0.002) {
    const double down = std::clamp(t / 0.3, 0.0, 1.0), open = std::clamp(1 - (t - 0.4) / 0.3, 0.0, 1.0);
    const double up = std::clamp((t - kLifts_s) / 0.2, 0.0, 1.0) * (young_pa > 1e4 ? 0.001 : 0.004);
    const Vec3 at(0.001, 0.002, kBlockTop_m + 0.002 - 0.0025 * down + up);
    scene.tools[0].trace.push_back({t, {at, Eigen::Quaterniond::Identity()}, 0.35 * open});
  }
  return scene;
}

// The forceps of a scene hold still for a while when they have closed, and lift what they hold by 3 cm.
constexpr double kHoldFor_s = 2, kLift_m = 0.03, kLiftFor_s = 1.2;
struct Lift {
  Scene scene;
  double closed_s = 0, ends_s = 0;
};
inline Lift lifting(Scene scene, std::uint32_t forceps, double speed_m_per_s) {
  std::vector<TracePoint>& trace = scene.tools[forceps].trace;
  const auto shut = std::ranges::find(trace, 0.0, &TracePoint::opening_rad);
  trace.erase(shut == trace.end() ? shut : shut + 1, trace.end());
  TracePoint last = trace.back();
  const double closed_s = last.time_s, lifts_s = closed_s + kHoldFor_s;
  const Vec3 from_m = last.pose_world.position_m;
  for (double t = closed_s + 0.01; t < lifts_s + kLiftFor_s; t += 0.01) {
    last.time_s = t;
    last.pose_world.position_m = from_m + std::clamp(speed_m_per_s * (t - lifts_s), 0.0, kLift_m) * Vec3::UnitZ();
    trace.push_back(last);
  }
  return {std::move(scene), closed_s, last.time_s};
}

}  // namespace sectio::test
