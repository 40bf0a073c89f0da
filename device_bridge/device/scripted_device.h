// Plays a recorded motion, whatever device it was recorded with; forces don't change it.
#pragma once

#include <vector>

#include "common/math/trace.h"
#include "device_bridge/device/device.h"

namespace sectio {

class ScriptedDevice : public Device {
 public:
  // The trace's time 0 is the beginning of the loop. Not empty.
  explicit ScriptedDevice(std::vector<TracePoint> trace) : trace_(std::move(trace)) {}

  Pose pose_world(double now_s) override { return pose_at(trace_, now_s); }
  double opening_rad(double now_s) const override { return point_at(trace_, now_s).opening_rad; }
  void apply(const Vec3&) override {}
  bool finished(double now_s) const override { return now_s > trace_.back().time_s; }

 private:
  std::vector<TracePoint> trace_;
};

}  // namespace sectio
