#include "sim_server/instruments/instrument.h"

#include <algorithm>

namespace sectio {
namespace {

constexpr double kCosWidestCut = 0.5;       // 60 degrees
constexpr double kShortestMotion_m = 1e-6;  // a shorter motion has no direction
constexpr double kStill_rad = 1e-6;         // jaws that move by less in a sample are still

}  // namespace

EdgeInWorld edge_at(const InstrumentShape& shape, const Pose& pose) {
  EdgeInWorld edge;
  edge.tip_world_m = pose.to_world(shape.edge_tip_tool_m);
  edge.up_world = (pose.to_world(shape.edge_heel_tool_m) - edge.tip_world_m).stableNormalized();
  return edge;
}

Crossings crossings_at(const InstrumentShape& shape, const Pose& pose, const Vec3& point_world_m,
                       const Vec3& normal_world) {
  const auto above = [&](const Vec3& corner_tool_m) {
    return (pose.to_world(corner_tool_m) - point_world_m).dot(normal_world) >= 0;
  };
  const bool a = above(shape.a_tool_m), b = above(shape.b_tool_m), c = above(shape.c_tool_m), d = above(shape.d_tool_m);
  return {a != b, a != c, b != d, above(shape.edge_tip_tool_m) != above(shape.edge_heel_tool_m)};
}

bool correct_direction(const InstrumentShape& shape, const Pose& pose, const Vec3& motion_world_m,
                       const Vec3& normal_world) {
  const auto in_surface = [&](const Vec3& x) -> Vec3 { return x - x.dot(normal_world) * normal_world; };
  const Vec3 motion = in_surface(motion_world_m);
  if (!shape.sharp_side_tool || motion.norm() < kShortestMotion_m) return true;
  const Vec3 sharp_side_world = pose.orientation * *shape.sharp_side_tool;
  return motion.normalized().dot(in_surface(sharp_side_world).stableNormalized()) >= kCosWidestCut;
}

Jaws jaws_between(double opening_before_rad, double opening_rad) {
  const double by_rad = opening_rad - opening_before_rad;
  return by_rad < -kStill_rad ? Jaws::closing : by_rad > kStill_rad ? Jaws::opening : Jaws::still;
}

double share_of_push(double step_s) {
  constexpr double kFilter_s = 0.005;
  return std::min(1.0, step_s / kFilter_s);
}

bool ruptures(const RuptureThreshold& threshold, double force_n, double displacement_m, bool has_just_cut) {
  const double factor = has_just_cut ? threshold.hysteresis : 1.0;
  if (threshold.displacement_m) return displacement_m >= factor * *threshold.displacement_m;
  return threshold.force_n && force_n >= factor * *threshold.force_n;
}

}  // namespace sectio
