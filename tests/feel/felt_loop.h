// A hand at a real simulation, in simulated time: hand, servo, a wire with delay, jitter and loss, and the simulation
// that answers each pose. Everything that the real programs do between hand and tissue, without clock or socket.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "device_bridge/device/virtual_hand.h"
#include "device_bridge/servo/servo_state.h"
#include "sim_server/scene/scene.h"

namespace sectio::test {

constexpr double kBlockTop_m = 0.03, kBall_m = 0.004;

// A block of 60 x 40 x 30 mm, fixed from below, whose top is z = kBlockTop_m around x = y = 0, under a probe with a
// ball of kBall_m about its tip, or under a scalpel.
Scene felt_block(const std::string& model, double young_pa, const std::string& tool = "probe");

struct WireSpec {
  double delay_s = 0;  // there and back; whatever it is, an answer comes a tick after its pose at the soonest
  double loss = 0;     // share of contact models
  double jitter_s = 0;
  std::uint64_t seed = 7;
};

struct FeltTick {
  double time_s = 0;
  Vec3 truth_n = Vec3::Zero();  // the simulation's force for the pose of this tick
  Vec3 felt_n = Vec3::Zero();
  double work_j = 0;  // on the hand, so far
};

constexpr double kTick_s = 0.001;

// A hand that moves as it likes, at the end of several wires at once: what each would feel.
using Path = std::function<Pose(double time_s)>;
std::vector<std::vector<FeltTick>> felt_on_path(const Scene& scene, const Path& path, double duration_s,
                                                const std::vector<WireSpec>& wires, const DeviceLimits& device = {});

// A hand that gives way: the virtual one, which wants to follow the path. The truth is what the simulation had for the
// pose that it knew.
std::vector<FeltTick> felt_in_loop(const Scene& scene, const Path& wish, double duration_s, const WireSpec& wire,
                                   const HandSpec& hand);

// The same at one tool of a scene whose other tools follow their traces; the hand wants to follow the trace of its own.
// A session that is late spares idle bodies.
std::vector<FeltTick> felt_in_scene(const Scene& scene, std::uint32_t tool, double duration_s, const WireSpec& wire,
                                    const HandSpec& hand, bool is_late = false);

// Across the block's top, from a time on: rms error over the rms of what varies in the truth, and over that of all of
// it. Sideways: rms error over the rms of the whole truth.
struct FeltError {
  double varying = 0, whole = 0, sideways = 0;
};
FeltError error_of(const std::vector<FeltTick>& ticks, double from_s);

// The same of a force that is held: rms about its mean, N, and mean power to the hand, W.
struct FeltHold {
  double ripple_n = 0, power_w = 0;
};
FeltHold hold_of(const std::vector<FeltTick>& ticks, double from_s);

// The time by which the felt force passes this level after the true one does; a negative one is early.
double late_s(const std::vector<FeltTick>& ticks, double level_n);

}  // namespace sectio::test
