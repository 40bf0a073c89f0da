// Detects that a body has come to rest. Its surface is observed in two windows of time, one after the other.
//
//   d(t) = max over vertices |x(t) - x(0)|          from the beginning of a window
//   at rest:  d <= bound all along,  and  max d in its second half <= 3/2 max d in the first
//
// The second condition tells a motion that decays or oscillates in place from a drift: a decaying motion will move the
// body by less than the bound after the window, too. A drift below a fiftieth of the bound is ignored. There are two
// windows because a slow oscillation is at rest at its turning point.
#pragma once

#include <vector>

#include "common/math/positions_view.h"
#include "common/math/types.h"

namespace sectio {

class Stillness {
 public:
  // Call after each step of step_s with the state after it. True when the body has been at rest for after_s.
  // O(vertices), 32 times in after_s; O(1) while something moves.
  bool watch(PositionsView positions_world_m, double step_s, double after_s, double bound_m);
  // Call when the body has been disturbed: the window begins anew.
  void begin_anew() { begun_ = again_ = false; }
  // Nothing has moved further than the bound in the window so far.
  bool is_calm() const { return begun_ && looks_ > 0; }

  template <class A>
  void archive(A& a) {
    a(begun_, time_s_, looks_, again_, first_m2_, second_m2_, liveliest_, from_world_m_);
  }

 private:
  bool begun_ = false;
  double time_s_ = 0;
  int looks_ = 0;
  bool again_ = false;                  // the body was at rest in the window before
  float first_m2_ = 0, second_m2_ = 0;  // squares of the largest displacements in the halves
  std::size_t liveliest_ = 0;           // the vertex that last exceeded the bound, tested first
  std::vector<Vec3f> from_world_m_;
};

}  // namespace sectio
