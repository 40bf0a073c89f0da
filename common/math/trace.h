// A trace: the recorded motion of an instrument, as a haptic device, a joystick or a mouse would send it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// A faster instrument is followed at this speed, unless its scene or somebody who starts a program says otherwise.
constexpr double kUsualMaxSpeed_m_per_s = 5;

struct TracePoint {
  double time_s = 0;
  Pose pose_world;
  double opening_rad = 0;  // between the blades of an instrument that has a joint
  bool operator==(const TracePoint& o) const {
    return time_s == o.time_s && pose_world.position_m == o.pose_world.position_m &&
           pose_world.orientation.coeffs() == o.pose_world.orientation.coeffs() && opening_rad == o.opening_rad;
  }
};

// Reads a CSV file with the columns time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz, found by their names in the first
// line, and opening_rad if there is one; other columns are skipped, so that the log of a device_bridge is a trace too.
// Empty lines and lines that begin with # are skipped. Times must ascend; quaternions are normalised. At least one
// point. Throws InputError "FILE:LINE: COLUMN: what is wrong".
std::vector<TracePoint> load_trace(const std::string& path);

// The first line of such a file, with opening_rad, and a point as one of its lines, without ends of lines. load_trace()
// reads the same numbers back.
std::string trace_columns();
void append_trace_point(std::string& line, const TracePoint& point);

// The state of the instrument at a time, interpolated between neighbours; it rests at the first point before the trace
// begins and at the last one after it ends. The trace must not be empty. O(log n).
TracePoint point_at(std::span<const TracePoint> trace, double time_s);
// `count` points (two or more), evenly spread over the time of the trace, its first and its last one included.
std::vector<TracePoint> moments_of(std::span<const TracePoint> trace, std::size_t count);
Pose pose_at(std::span<const TracePoint> trace, double time_s);

}  // namespace sectio
