// How often a bridge sends poses. Answers that are long on their way come over a link that is far, where a packet more
// or less makes no difference, or thin, where packets wait for each other: there fewer ones arrive earlier.
#pragma once

#include <algorithm>
#include <vector>

#include "common/messages/tool.h"

namespace sectio {

class PosePace {
 public:
  static constexpr double kShortest_s = 0.0005, kLongest_s = 0.025;
  static constexpr double kPrompt_s = 0.05;  // answers no older than this are as good as they come
  static constexpr double kShare = 0.125;    // the part of what they are older that an interval has

  // `now_s`: any steady clock, here and below.
  void sent(double now_s) {
    if (heard_s_ < 0) heard_s_ = now_s;
  }
  // An answer to a pose that was sent so long ago.
  void answered(double now_s, double age_s) {
    heard_s_ = now_s;
    age_s_ = age_s;
  }
  // A packet is due this long after the last one. Nobody answers: as if the answer were as old as that silence.
  double interval_s(double now_s) const {
    const double age_s = heard_s_ < 0 ? 0 : std::max(age_s_, now_s - heard_s_);
    return std::clamp(kShare * (age_s - kPrompt_s), kShortest_s, kLongest_s);
  }

 private:
  double heard_s_ = -1, age_s_ = 0;
};

// A pose of the servo loop that has not been sent yet. One that doesn't go on comes after a hole.
struct FreshPose {
  ToolSample sample;
  bool goes_on = true;
};

// So many of them, the last one included.
inline std::vector<FreshPose> evenly(const std::vector<FreshPose>& poses, std::size_t count) {
  std::vector<FreshPose> some;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const bool begins = some.empty() || i >= some.size() * poses.size() / count;
    if (begins) some.push_back(poses[i]);
    some.back() = {poses[i].sample, poses[i].goes_on && (begins || some.back().goes_on)};
  }
  return some;
}

}  // namespace sectio
