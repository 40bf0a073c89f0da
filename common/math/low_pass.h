// A first-order low-pass filter, x += share * (sample - x), implicit in time: stable for any step.
#pragma once

namespace sectio {

inline double low_pass_share(double step_s, double filter_s) {
  return step_s / (step_s + filter_s);
}

}  // namespace sectio
