// Two servers run a session with the same body: which of them gives way.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace sectio {

// One server's knowledge of the other, which comes late. The one that has begun stays; when both or none have, the one
// that has simulated more by kHeadStart_s; else the one with the lower epoch, whatever its clock says. While messages
// are slow, each may see itself ahead, so that both stay for a while; none sees itself behind where it is ahead.
class Rivalry {
 public:
  static constexpr double kHeadStart_s = 0.2;  // less is no head start
  static constexpr double kPatience_s = 5;     // two that each see themselves ahead for so long are equals

  // A message of the other server came. `other_time_s`: its simulated time when it sent that; `own_time_s`: this one's
  // now; `now_s`: any steady clock, here and below.
  void hear(double other_time_s, double own_time_s, double now_s) {
    other_has_begun_ |= other_time_s > 0;
    lead_s_ = std::max(lead_s_, other_time_s - own_time_s);
    if (other_has_begun_ && own_time_s > 0 && !beside_since_s_) beside_since_s_ = now_s;
  }

  // Has this one, which has simulated so much, to give way?
  bool gives_way(double own_time_s, bool other_has_lower_epoch, double now_s) const {
    const bool has_begun = own_time_s > 0;
    if (has_begun != other_has_begun_) return other_has_begun_;
    const bool are_equals = beside_since_s_ && now_s - *beside_since_s_ > kPatience_s;
    if (has_begun && std::abs(lead_s_) > (are_equals ? 2 : 1) * kHeadStart_s) return lead_s_ > 0;
    return other_has_lower_epoch;
  }

 private:
  bool other_has_begun_ = false;
  double lead_s_ = -std::numeric_limits<double>::infinity();  // least lead of the other server, by its fastest message
  std::optional<double> beside_since_s_;                      // both have run since then
};

}  // namespace sectio
