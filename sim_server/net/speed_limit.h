// Bounds the speed of an instrument, whatever its poses say: a faster one is followed at the limit. One instrument.
#pragma once

#include "common/math/trace.h"
#include "common/messages/tool.h"

namespace sectio {

class SpeedLimit {
 public:
  static constexpr double kFastestTurn_rad_per_s = 50;  // a tip that is 0.1 m away moves as fast as 5 m/s
  static constexpr double kSaved_s = 0.005;             // so much of a rest is made up for by the next motion

  explicit SpeedLimit(double fastest_m_per_s = kUsualMaxSpeed_m_per_s) : fastest_m_per_s_(fastest_m_per_s) {}

  // The pose that the instrument has, for the one that was asked for. `now_s` ascends; a new source begins anew.
  Pose follow(const ToolSample& sample, double now_s);

 private:
  double fastest_m_per_s_;
  bool any_ = false;
  std::uint64_t source_ = 0;
  Pose pose_;
  double last_s_ = 0, saved_s_ = 0;
};

}  // namespace sectio
