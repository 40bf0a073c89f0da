// Motions from place to place, for scenes whose instruments go through a body or hold it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// An instrument whose tip goes from place to place at constant speed, its sharp edge ahead. A blade that is longer than
// a body is thick goes through it.
struct Place {
  Vec3 tip_world_m;
  double ahead_deg;             // the sharp edge points there, from +x towards +y
  double rest_s = 0;            // here, before it goes on
  double speed_m_per_s = 0.03;  // to here
  double opening_rad = 0;       // opening of the jaws; at one place they turn while they rest
  double lean_deg = 0;          // its upper end leans to the right of its way
};
struct Passage {
  const char* name;
  std::vector<Place> places;
  bool has_jaws = false;
};

std::span<const Passage> passages();

// The passage as CSV.
std::string trace_of(const Passage& passage);

}  // namespace sectio
