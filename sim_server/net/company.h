// The hands and viewers that a standby hears. When the server is silent and its hands aren't, it is dead or cut off.
// When all are silent at once, this program is cut off, and has nobody to go on for. Two servers harm nobody in a
// session without a hand: they make the same steps.
#pragma once

#include <cmath>

namespace sectio {

class Company {
 public:
  static constexpr double kKnown_s = 3;      // one that was heard this long before the silence should be heard after it
  static constexpr double kHandsGone_s = 3;  // a server that is silent together with its hands is given so much longer
  static constexpr double kOnTheWay_s = 0.02;  // sent before the silence, and heard after it

  // `now_s`: any steady clock, here and below.
  void hear_hand(double now_s) { hand_s_ = now_s; }
  void hear_viewer(double now_s) { viewer_s_ = now_s; }

  // The server is silent since then. True, too, when no hand was there before.
  bool shows_that_it_is_gone(double since_s, double now_s) const {
    const auto was_there = [&](double heard_s) { return heard_s >= since_s - kKnown_s; };
    const auto is_there = [&](double heard_s) { return heard_s > since_s + kOnTheWay_s; };
    if (!was_there(hand_s_) || is_there(hand_s_)) return true;
    return is_there(viewer_s_) && now_s - since_s > kHandsGone_s;
  }

 private:
  double hand_s_ = -HUGE_VAL, viewer_s_ = -HUGE_VAL;
};

}  // namespace sectio
