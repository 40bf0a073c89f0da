// A clock that counts the time in which its program looks at it. A program that was halted has not heard what others
// said meanwhile, and can't tell who was silent.
#pragma once

#include <algorithm>
#include <optional>

#include "common/core/wall_time.h"

namespace sectio {

class AttentiveClock {
 public:
  // A longer time between two looks counts as this one.
  explicit AttentiveClock(double longest_look_s) : longest_look_s_(longest_look_s) {}

  // `steady_s` ascends. Returns how much of the time since the last look counts.
  double look(double steady_s = steady_now_s()) {
    const double passed_s = looked_s_ ? std::min(longest_look_s_, steady_s - *looked_s_) : 0;
    looked_s_ = steady_s;
    now_s_ += passed_s;
    return passed_s;
  }
  // The time that has counted, up to the last look.
  double now_s() const { return now_s_; }

 private:
  double longest_look_s_;
  double now_s_ = 0;
  std::optional<double> looked_s_;
};

}  // namespace sectio
