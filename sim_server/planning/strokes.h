// The ways of blades through a body, from their traces. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "sim_server/planning/body_loads.h"

namespace sectio::planning {

// A blade in a body, over its whole trace.
struct Stroke {
  std::string from;  // name of the instrument
  double way_m = 0;  // the tip goes so far in the body
  double area_m2 = 0;
  double time_s = 0;
  bool goes_through = false;

  double depth_m() const { return way_m > 0 ? area_m2 / way_m : 0; }
};

// The strokes of blades that reach the body. One without a trace may go through it, as fast as a hand cuts.
// O(triangles * moments).
std::vector<Stroke> strokes_in(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& situation);

}  // namespace sectio::planning
