// An instrument that cuts with templates (paper A, 2.3): its edge may break the surface anywhere along its length, and
// every part of the edge in the body cuts. The surface itself is asked which parts are in the body; a plane would not
// do at an edge of the body, or at the point where the blade comes out on the other side. Pure queries.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/world/body.h"
#include "sim_server/world/instrument_edge.h"
#include "sim_server/world/press_point.h"

namespace sectio {

constexpr double kDeepEdge_m = 0.003;  // an edge this deep in tissue has broken in, as in the middle of a thin body
constexpr double kNoTravel_m = 1e-7;   // a motion below this has no direction

// The edge opens a surface wherever it is, and leaves an opening between two walls.
inline bool opens_from_edge(const CutTraits& traits) {
  return traits.edge_cuts_anywhere && !traits.cuts_inside;
}

// An edge that presses with its sharp part may break in there.
bool sharp_edge_presses(Body& body, const InstrumentEdge& edge, const PressPoint& press, const Vec3& normal_world);
// The blunt back leads where it presses: its tip goes beside the surface rather than in.
bool back_presses(const InstrumentEdge& edge, const Vec3& normal_world);
// An edge that presses is in a groove, with walls close to both its sides. A blade that is put back into its cut goes
// on without breaking in.
bool sharp_edge_is_in_slit(Body& body, const InstrumentEdge& edge, const PressPoint& press);
// The edge is beside a wall of a cut, as that of a half which it has cut off and which has swung away.
bool is_beside_wall(Body& body, const InstrumentEdge& edge);
// The tip is between the walls of a cut, however far these gape.
bool tip_is_in_groove(Body& body, const InstrumentEdge& edge);
// The tip will lie between the walls once the tissue is at rest in this frame. O(triangles).
bool tip_will_be_in_groove(const Body& body, const InstrumentEdge& edge, const Pose& frame_world);
// The first part of a line along the edge, from `tip_world_m` on, that is in tissue which no cut has opened.
std::optional<SurfaceHit> uncut_tissue_at(Body& body, const InstrumentEdge& edge, const Vec3& tip_world_m);
// The place at which an edge that moves towards its sharp side is so deep inside that it has broken in, whatever its
// force was.
std::optional<SurfaceHit> sharp_edge_deep_inside(Body& body, const InstrumentEdge& edge, const JointPose& before);

// The blade further back, outside of the body or in a slit of it, with what it has pushed in between. Nothing: there is
// no such place within `farthest_back_m`.
std::optional<Blade> blade_outside(Body& body, const InstrumentEdge& edge, const Blade& inside, double farthest_back_m);
// The leaf of the decision tree (paper B, figure 4) for the parts of the instrument that cross the surface.
CutDecision decide_by_surface(Body& body, const InstrumentEdge& edge, bool is_correct_direction, Jaws jaws);
// The triangles that a blade comes near from one place along a path.
std::vector<TriangleId> swept_over(Body& body, const InstrumentEdge& edge, const Blade& from,
                                   std::span<const Blade> path);

}  // namespace sectio
