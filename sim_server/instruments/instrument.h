// What an instrument does to tissue (paper B, section 3; paper A, 2.3): where its parts are, and which of them cut
// when. Pure functions of plain values; any room of the server may include this.
//
// A kind of instrument is a file of its own: its usual geometry, its shape and its decision rule, as one entry of the
// table behind instrument_of().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// Corner points of the instrument in its own frame (paper B, figure 3): A the tip, AC the sharp edge, AB the shaft's
// axis, BD the top and CD the blunt front above the edge. For a cautery hook AC is the probe and CD the virtual tip.
// Scissors, forceps: A the tips when closed, B the end of the handles, C the pivot, AD from the edge to the lower
// blade's back.
struct ToolGeometry {
  Vec3 a_tool_m = Vec3::Zero();
  Vec3 b_tool_m = Vec3(0, 0, 0.03);
  Vec3 c_tool_m = Vec3(0.006, 0, 0.012);
  Vec3 d_tool_m = Vec3(0.006, 0, 0.03);
  double sharp_length_m = 0;   // knife: of AC from A on; the rest is blunt
  double gauge_m = 0;          // medical scissors: between the two edges of a U
  double sphere_radius_m = 0;  // about A: what a ball there pushes out of the way; 0: none
};

// What else the parts depend on.
struct InstrumentState {
  double intensity = 1;    // cautery: |CD| = intensity x geometry's |CD|
  double opening_rad = 0;  // of jaws
  std::size_t edge = 0;    // which one of several
};

// Where the parts are, in the tool's frame.
struct InstrumentShape {
  Vec3 a_tool_m, b_tool_m, c_tool_m, d_tool_m;  // AB, AC, BD and CD touch tissue
  Vec3 edge_tip_tool_m, edge_heel_tool_m;       // the line that cuts, from its lower end; no line: the same point
  std::optional<Vec3> sharp_side_tool;          // unit, the way it cuts; nothing: any way
};

// The line that cuts.
struct EdgeInWorld {
  Vec3 tip_world_m = Vec3::Zero();
  Vec3 up_world = Vec3::UnitZ();  // unit
};
EdgeInWorld edge_at(const InstrumentShape& shape, const Pose& pose);

// Which parts cross the surface where the instrument is.
struct Crossings {
  bool ab = false, ac = false, bd = false;
  bool edge = false;  // the line that cuts
};
// Of the plane through `point` that stands for the surface there.
Crossings crossings_at(const InstrumentShape& shape, const Pose& pose, const Vec3& point_world_m,
                       const Vec3& normal_world);

// Is a motion over the surface one that cuts? Within 60 degrees of the sharp side, both seen in the surface; so short a
// motion that it has no direction counts as correct.
bool correct_direction(const InstrumentShape& shape, const Pose& pose, const Vec3& motion_world_m,
                       const Vec3& normal_world);

enum class Jaws : std::uint8_t { still, closing, opening };
Jaws jaws_between(double opening_before_rad, double opening_rad);

// The leaves of figure 4.
enum class Leaf : std::uint8_t {
  detect_again,       // no contact here
  cut,                // the edge crosses, the motion is towards the sharp side
  push_back,          // the edge crosses, the motion is not: force, and the object deforms
  push_out,           // AC is inside as a whole: force, and AC is pushed out of the surface
  deform_with_shaft,  // only what is blunt crosses: force, and the object deforms
};

struct Situation {
  Crossings crossings;
  bool correct_direction = false;
  Jaws jaws = Jaws::still;
};

struct InstrumentKind {
  std::string_view name;
  ToolGeometry geometry;  // the usual one
  InstrumentShape (*shape)(const ToolGeometry& geometry, const InstrumentState& state);
  // Of an edge that is in the tissue.
  Leaf (*decide)(const Situation& situation);
  // What is wrong with a geometry; empty if nothing.
  std::string (*flaw)(const ToolGeometry& geometry);

  std::size_t edges = 1;
  bool presses_with_tip = false;  // the tip A holds on to where it touches; else what is inside is the contact
  bool tip_pierces = false;       // pressing with it breaks the surface at the threshold
  bool edge_enters = false;       // the edge cuts where it reaches into the tissue, however light the touch
  bool only_closing = false;      // and only while the jaws close
  bool front_is_virtual = false;  // CD is no body: it doesn't press
  double grip_below_rad = 0;      // jaws closed further hold what is between their tips; 0: never
  double grip_force_n = 0;        // at most
  double grip_radius_m = 0;       // about A: tissue in this sphere is between the tips
  double drag = 1;                // of the force that cutting takes

  // May an edge that reaches into tissue begin to cut?
  bool may_enter(Jaws jaws) const { return edge_enters && (!only_closing || jaws == Jaws::closing); }
};

// Throws InputError on an unknown kind.
const InstrumentKind& instrument_of(std::string_view kind);
std::vector<std::string> instrument_kinds();

// The border between deforming and cutting.
struct RuptureThreshold {
  std::optional<double> force_n;         // pushing force, the default
  std::optional<double> displacement_m;  // of the surface, the alternative
  double hysteresis = 0.7;               // an instrument that has just been cutting needs only this fraction
};
bool ruptures(const RuptureThreshold& threshold, double force_n, double displacement_m, bool has_just_cut);

}  // namespace sectio
