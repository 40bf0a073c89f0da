// Has a body come to rest? Its surface is looked at in two windows of time, one after the other.
//
//   d(t) = max over vertices |x(t) - x(0)|          from the beginning of a window
//   at rest:  d <= bound all along,  and  max d in its second half <= 3/2 max d in the first
//
// The second condition tells what decays or swings in place from what goes on drifting: what a decaying motion would
// still do after the window is less than the bound, too. A drift below a fiftieth of the bound is none. Two windows,
// since a slow swing rests at its turning point.
#pragma once

#include <span>
#include <vector>

#include "common/math/types.h"

namespace sectio {

class Stillness {
 public:
  // After a step of step_s, with the state that it left. True when it has been at rest for after_s. O(vertices), 32
  // times in after_s; O(1) while something moves.
  bool watch(std::span<const Vec4f> position_world_m, double step_s, double after_s, double bound_m);
  // Something has stirred it: the window begins anew.
  void begin_anew() { begun_ = again_ = false; }

 private:
  bool begun_ = false;
  double time_s_ = 0;
  int looks_ = 0;
  bool again_ = false;                  // it rested in the window before
  float first_m2_ = 0, second_m2_ = 0;  // squares of the largest displacements in the halves
  std::size_t liveliest_ = 0;           // the vertex that was too far the last time
  std::vector<Vec4f> from_world_m_;
};

}  // namespace sectio
