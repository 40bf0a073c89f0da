// How much a hand trembles: the distance of a tip from its own path, smoothed. The smoothed place is that of a parabola
// fitted to kWindow_s around each moment (Savitzky and Golay), so that neither speed nor acceleration is tremor. The
// squares are averaged by the tenth of a second, and the median of these counts: a corner of the path is no tremor
// either. A tip that stands still doesn't count: it says nothing of the hand that cuts.
#pragma once

#include <cstddef>
#include <vector>

#include "common/math/types.h"

namespace sectio {

class TremorGauge {
 public:
  static constexpr double kWindow_s = 0.2;     // tremor of 8 to 12 Hz is told within a quarter
  static constexpr double kLeastWay_m = 1e-4;  // the way of a tip in a window

  explicit TremorGauge(double step_s = 1);
  // The tip after a step. `counts`: it is at work.
  void add(const Vec3& tip_world_m, bool counts);
  // Root mean square while the tip was at work and moved; 0 when that was for no whole window.
  double rms_m() const;

  template <class A>
  void archive(A& a) {
    a(half_, tips_world_m_, counts_, next_, square_m2_, samples_, squares_m2_);
  }

 private:
  std::size_t half_ = 2;            // samples on each side of the one in the middle
  std::vector<Vec3> tips_world_m_;  // the last ones, in a ring of 2 half + 1
  std::vector<bool> counts_;
  std::size_t next_ = 0;  // place of the next one
  double square_m2_ = 0;  // sum over the present tenth of a second
  std::size_t samples_ = 0;
  std::vector<double> squares_m2_;  // means of those before
};

}  // namespace sectio
