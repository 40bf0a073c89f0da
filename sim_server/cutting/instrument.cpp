#include "sim_server/cutting/instrument.h"

namespace sectio {
namespace {

constexpr double kCosWidestCut = 0.5;      // 60 degrees
constexpr double kShortestMotionM = 1e-6;  // below this a motion has no direction

}  // namespace

Blade blade_at(const InstrumentShape& shape, const Pose& pose) {
  Blade blade;
  blade.tip_world_m = pose.to_world(shape.blade_tip_tool_m());
  blade.up_world = (pose.to_world(shape.blade_heel_tool_m()) - blade.tip_world_m).stableNormalized();
  return blade;
}

Vec3 sharp_side_world(const InstrumentShape& shape, const Pose& pose) {
  const Vec3 axis = (shape.b_tool_m - shape.a_tool_m).stableNormalized();
  const Vec3 towards_c = shape.c_tool_m - shape.a_tool_m;
  return pose.orientation * (towards_c - towards_c.dot(axis) * axis).stableNormalized();
}

Crossings crossings_at(const InstrumentShape& shape, const Pose& pose, const Vec3& point_world_m,
                       const Vec3& normal_world) {
  const auto above = [&](const Vec3& corner_tool_m) {
    return (pose.to_world(corner_tool_m) - point_world_m).dot(normal_world) >= 0;
  };
  const bool a = above(shape.a_tool_m), b = above(shape.b_tool_m), c = above(shape.c_tool_m), d = above(shape.d_tool_m);
  return {a != b, a != c, b != d};
}

Leaf decide(const Crossings& crossings, bool correct_direction) {
  if (!crossings.ab) return Leaf::detect_again;
  if (crossings.ac) return correct_direction ? Leaf::cut : Leaf::push_back;
  return crossings.bd ? Leaf::push_out : Leaf::deform_with_shaft;
}

bool correct_direction(const InstrumentShape& shape, const Pose& pose, const Vec3& motion_world_m,
                       const Vec3& normal_world) {
  const auto in_surface = [&](const Vec3& x) -> Vec3 { return x - x.dot(normal_world) * normal_world; };
  const Vec3 motion = in_surface(motion_world_m);
  if (shape.cautery || motion.norm() < kShortestMotionM) return true;
  return motion.normalized().dot(in_surface(sharp_side_world(shape, pose)).stableNormalized()) >= kCosWidestCut;
}

bool ruptures(const RuptureThreshold& threshold, double force_n, double displacement_m, bool has_just_cut) {
  const double factor = has_just_cut ? threshold.hysteresis : 1.0;
  if (threshold.displacement_m) return displacement_m >= factor * *threshold.displacement_m;
  return threshold.force_n && force_n >= factor * *threshold.force_n;
}

}  // namespace sectio
