// What an instrument does to tissue (paper B, section 3): the decision tree of figure 4, the direction in which a blade
// cuts, and the threshold between deforming and cutting. Pure functions.
#pragma once

#include <optional>

#include "sim_server/cutting/stroke.h"

namespace sectio {

// Corner points in the instrument's own frame (figure 3).
struct InstrumentShape {
  Vec3 a_tool_m, b_tool_m, c_tool_m, d_tool_m;
  // A cautery hook cuts where CD, the virtual tip beyond the probe AC, is in the tissue, and in any direction.
  bool cautery = false;

  // The lower end of what touches tissue without cutting it: the scalpel's tip A, the cautery's probe end C.
  const Vec3& probe_tool_m() const { return cautery ? c_tool_m : a_tool_m; }
  // The line that cuts, from its lower end.
  const Vec3& blade_tip_tool_m() const { return cautery ? d_tool_m : a_tool_m; }
  const Vec3& blade_heel_tool_m() const { return c_tool_m; }
};

Blade blade_at(const InstrumentShape& shape, const Pose& pose);
// The side of the sharp edge: from the shaft's axis AB towards C, square to the axis. Unit.
Vec3 sharp_side_world(const InstrumentShape& shape, const Pose& pose);

// Which parts cross the surface where the instrument is.
struct Crossings {
  bool ab = false, ac = false, bd = false;
};
// Of the plane through `point` that stands for the surface there.
Crossings crossings_at(const InstrumentShape& shape, const Pose& pose, const Vec3& point_world_m,
                       const Vec3& normal_world);

// The leaves of figure 4.
enum class Leaf : std::uint8_t {
  detect_again,       // AB does not cross: no contact here
  cut,                // AB and AC cross, the motion is towards the sharp edge
  push_back,          // AB and AC cross, the motion is not: force, and the object deforms
  push_out,           // AC is inside as a whole: force, and AC is pushed out of the surface
  deform_with_shaft,  // only AB crosses: force, and the object deforms
};
Leaf decide(const Crossings& crossings, bool correct_direction);

// Is a motion over the surface one that cuts? Within 60 degrees of the sharp side, both seen in the surface; so short a
// motion that it has no direction counts as correct.
bool correct_direction(const InstrumentShape& shape, const Pose& pose, const Vec3& motion_world_m,
                       const Vec3& normal_world);

// The border between deforming and cutting.
struct RuptureThreshold {
  std::optional<double> force_n;         // pushing force, the default
  std::optional<double> displacement_m;  // of the surface, the alternative
  double hysteresis = 0.7;               // an instrument that has just been cutting needs only this fraction
};
bool ruptures(const RuptureThreshold& threshold, double force_n, double displacement_m, bool has_just_cut);

}  // namespace sectio
