// The geometry of instruments, and the rules by which they cut, press or push (paper B, section 3; paper A, 2.3). Pure
// functions of plain values; any room of the server may include this.
//
// Each kind of instrument is a file of its own: its default geometry, its shape and its decision rule, as one entry of
// the table behind instrument_of().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// Corner points of the instrument in its own frame (paper B, figure 3): A is the tip, AC the sharp edge, AB the axis of
// the shaft, BD the top and CD the blunt front above the edge. A cautery hook has AC as its probe and CD as its virtual
// tip. In scissors and forceps A is the closed tips, B the end of the handles, C the pivot; AD leads from the edge to
// the back of the lower blade.
struct ToolGeometry {
  Vec3 a_tool_m = Vec3::Zero();
  Vec3 b_tool_m = Vec3(0, 0, 0.03);
  Vec3 c_tool_m = Vec3(0.006, 0, 0.012);
  Vec3 d_tool_m = Vec3(0.006, 0, 0.03);
  double sharp_length_m = 0;   // knife: length of the sharp part of AC from A on
  double gauge_m = 0;          // medical scissors: distance between the two edges of a U
  double sphere_radius_m = 0;  // radius of a ball about A that pushes tissue out of its way; 0: none
};

// The state of the instrument besides its pose.
struct InstrumentState {
  double intensity = 1;    // cautery: |CD| = intensity x geometry's |CD|
  double opening_rad = 0;  // angle between the jaws
  std::size_t edge = 0;    // number of the edge, where there are several
  // The opening from which blades close about tissue that ends between them; 0: about other tissue, or none.
  double closes_from_rad = 0;

  template <class A>
  void archive(A& a) {
    a(intensity, opening_rad, edge, closes_from_rad);
  }
};

// The places of the parts in the tool's frame.
struct InstrumentShape {
  Vec3 a_tool_m, b_tool_m, c_tool_m, d_tool_m;  // AB, AC, BD and CD touch tissue
  Vec3 edge_tip_tool_m, edge_heel_tool_m;       // the cutting edge, from its lower end; the same point if there is none
  std::optional<Vec3> sharp_side_tool;          // unit, the direction in which the edge cuts; nothing: any direction

  template <class A>
  void archive(A& a) {
    a(a_tool_m, b_tool_m, c_tool_m, d_tool_m, edge_tip_tool_m, edge_heel_tool_m, sharp_side_tool);
  }
};

// The cutting edge in the world.
struct EdgeInWorld {
  Vec3 tip_world_m = Vec3::Zero();
  Vec3 up_world = Vec3::UnitZ();  // unit
};
EdgeInWorld edge_at(const InstrumentShape& shape, const Pose& pose);

// The parts of the instrument that cross the surface.
struct Crossings {
  bool ab = false, ac = false, bd = false;
  bool edge = false;  // the cutting edge
};
// The surface is approximated by the plane through `point`.
Crossings crossings_at(const InstrumentShape& shape, const Pose& pose, const Vec3& point_world_m,
                       const Vec3& normal_world);

// Whether a motion over the surface cuts: it must be within 60 degrees of the sharp side, both projected onto the
// surface. A motion too short to have a direction counts as correct.
bool correct_direction(const InstrumentShape& shape, const Pose& pose, const Vec3& motion_world_m,
                       const Vec3& normal_world);

enum class Jaws : std::uint8_t { still, closing, opening };
Jaws jaws_between(double opening_before_rad, double opening_rad);

// The leaves of the decision tree of paper B, figure 4.
enum class CutDecision : std::uint8_t {
  detect_again,       // no contact here
  cut,                // the edge crosses the surface, and the motion is towards the sharp side
  push_back,          // the edge crosses, but the motion is elsewhere: there is a force, and the object deforms
  push_out,           // all of AC is inside: there is a force, and AC is pushed out of the surface
  deform_with_shaft,  // only blunt parts cross: there is a force, and the object deforms
};

struct Situation {
  Crossings crossings;
  bool correct_direction = false;
  Jaws jaws = Jaws::still;
};

struct InstrumentKind {
  std::string_view name;
  ToolGeometry geometry;  // default
  InstrumentShape (*shape)(const ToolGeometry& geometry, const InstrumentState& state);
  // The decision for an edge at the tissue.
  CutDecision (*decide)(const Situation& situation);
  // The flaw of a geometry, as a text for a person; empty if there is none.
  std::string (*flaw)(const ToolGeometry& geometry);

  std::size_t edges = 1;
  bool presses_with_tip = false;  // the tip A sticks to the point that it touches; else the parts inside press
  bool tip_pierces = false;       // a tip that presses breaks the surface at the threshold
  bool edge_enters = false;       // the edge cuts as soon as it reaches into the tissue, at any force
  bool only_closing = false;      // the edge enters only while the jaws close
  bool front_is_virtual = false;  // CD has no body: it doesn't press
  double grip_below_rad = 0;      // jaws closed beyond this angle hold what is between their tips; 0: they never do
  double grip_force_n = 0;        // largest force of the grip
  double grip_radius_m = 0;       // tissue in this sphere about A is between the tips
  double drag = 1;                // factor of the force that cutting takes

  // Whether an edge that reaches into tissue may begin to cut.
  bool may_enter(Jaws jaws) const { return edge_enters && (!only_closing || jaws == Jaws::closing); }
};

// Throws InputError on an unknown kind.
const InstrumentKind& instrument_of(std::string_view kind);
std::vector<std::string> instrument_kinds();

// The threshold between deforming and cutting.
struct RuptureThreshold {
  std::optional<double> force_n;         // pushing force (default)
  std::optional<double> displacement_m;  // displacement of the surface (alternative)
  double hysteresis = 0.7;               // factor of the threshold for an instrument that has just been cutting
};
// The share of a new push that one step lets through the low-pass before the threshold; a device has such a filter.
double share_of_push(double step_s);
bool ruptures(const RuptureThreshold& threshold, double force_n, double displacement_m, bool has_just_cut);

}  // namespace sectio
