// How a hand differs from the traces that a scene was made with. Pure functions from trace to trace, and one from scene
// to scene which applies them all: the same seed gives the same scene.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim_server/scene/scene.h"

namespace sectio {

using Trace = std::vector<TracePoint>;

struct Hand {
  double shift_m = 0;        // largest shift of all traces together, in any direction
  double turn_deg = 0;       // largest turn of all traces together, about a vertical axis
  double slower = 1;         // takes so many times as long
  double faster = 1;         // takes so many times less time
  double tremor_m = 0;       // root mean square of the distance from the quiet hand
  std::uint32_t lifts = 0;   // lifts of all cutting instruments, spread over their way
  double back_m = 0;         // an instrument is put down at most so far behind where it was lifted
  std::uint32_t pauses = 0;  // each lasts a second
  std::uint32_t saws = 0;    // times that instruments go back along their way and forth again, spread over it
};

// A rigid motion: about the pivot, then along.
struct Motion {
  Vec3 pivot_world_m = Vec3::Zero();
  double turn_rad = 0;  // about the world's z
  Vec3 shift_world_m = Vec3::Zero();
};
Trace moved(Trace trace, const Motion& motion);

// The same path in `factor` times the time.
Trace stretched(Trace trace, double factor);

// Stands still at_s for so long.
Trace waiting(const Trace& trace, double at_s, double for_s);

// Goes back along its way to where it was at back_s, and forth again; then it goes on.
Trace sawing(const Trace& trace, double at_s, double back_s);

// Adds a motion of frequencies from 8 to 12 Hz (physiological tremor) whose distance from the trace has this root mean
// square. Sampled every 5 ms.
Trace trembling(const Trace& trace, double rms_m, std::uint64_t seed);

// Is lifted at_s by up_m, out of its slit along its axis (unit, to the handle; up, unless it lies flat), and put down
// again likewise where it was at resume_s (before at_s: the path between is passed again); then it goes on. All of that
// takes kLiftTakes_s more.
constexpr double kLiftTakes_s = 1.6;
Trace lifted(const Trace& trace, double at_s, double up_m, double resume_s, const Vec3& axis_tool = Vec3::UnitZ());

// The time at which a fraction of the path is behind; of a trace that stays in place, its beginning. The path is what
// lies between neighbours that count, or all of it when there are none. `counts`: one a point; empty: all count.
double time_at_path(const Trace& trace, double fraction, const std::vector<bool>& counts = {});

// The scene as this hand plays it: traces, duration, turns of gravity, which wait for it, and how long it should touch.
Scene in_hand(Scene scene, const Hand& hand, std::uint64_t seed);

// "shift 1 mm, turn 3 deg, lifts 1"; "exact" for a hand that follows its traces.
std::string to_text(const Hand& hand);

}  // namespace sectio
