// A blade in one body while it is in the tissue: progressive cutting with temporary subdivision (paper B, 5.1).
//
// The permanent part of the cut ends at the apex of the cell that contains the instrument. Inside the cell the cut
// follows the instrument by a temporary subdivision, which is undone before anything else is planned. When the
// instrument leaves the cell, the cut through it becomes a straight line from entry to exit (figure 1).
//
// The action of a blade depends on two places alone, both at rest: the end of the cut that it works on, and the place
// of the blade (blade_place.h). In a groove it cuts nothing, in any direction. Out of a groove over an end it goes
// on from that end; elsewhere it branches off. Over the lip of another groove, or of its own, the cuts meet.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sim_server/surface/cutting/blade_place.h"
#include "sim_server/surface/cutting/cut_plan.h"
#include "sim_server/surface/cutting/surface_point.h"
#include "sim_server/surface/cutting/templates.h"

namespace sectio {

// Distances are at rest, unless they end in `world_m`; cosines are to the heading of a cut, unless they say otherwise.
struct StrokeSettings {
  double snap_ratio = 0.08;   // a crossing this close to a corner of its edge (ratio of its length) goes through it
  double inset = 0.04;        // least barycentric coordinate of a vertex inside a triangle
  double min_step_m = 1e-4;   // motion of the instrument before a cut opens
  double min_depth_m = 3e-4;  // least depth of a groove
  double release_depth_m = -2e-4;  // the stroke ends when the depth of the tip is below this
  double join_tolerance_m = 2e-3;

  // A blade in a groove, or out of one.
  double beside_m = 5e-4;            // one this near to a curve is in the groove
  double stays_beside_m = 8e-4;      // the same, if it was in a groove before
  double leaves_m = 0.01;            // from the curve that a blade leaves to the place where it is next, at most
  double resumes_m = 3e-3;           // distance from the end of the groove that a blade leaves, and goes on from
  double same_sheet_world_m = 3e-3;  // from the end of a cut to its blade, so near that no lid needs to be asked
  double widest_gape_ratio = 4;      // way at rest to a lid's place, over the way in the world, at most

  // A blade ahead of the end of its cut, or behind it.
  double ahead_cos = 0.5, back_cos = -0.5;
  double own_way_ratio = 0.5;  // share of the way back at rest, which the blade itself has gone at least
  double most_owed_m = 3e-3;   // from the end of a cut to its blade, or to where it begins anew

  // Branches and meetings.
  double node_m = 1.5e-3;       // least distance of a branch, or a crossing, from an end or from where cuts have met
  double rung_ratio = 0.25;     // it is at a rung this close, as a ratio of the lip's length
  double along_lip_cos = 0.94;  // to a lip, from which on a cut would run along it
  double overshoot_m = 2e-4;    // beyond a lip, so that the way leads over it

  // The way over the surface to a place: so many times as long as the straight one, and so much longer. Beyond that it
  // goes round the body.
  double longest_way_ratio = 4, longest_detour_m = 2e-3;
};

// A stroke's knowledge of its blade, whether or not there is a cut under way.
struct BladeSeen {
  double depth_m = 0;                 // the tip, below the surface
  std::optional<Vec3> at_world_m;     // the blade last entered the surface here
  std::optional<Vec3> on_lid_body_m;  // it was in a groove, at this place of its curve at rest
  bool was_away = false;              // it has not been at the surface since
  bool begins_anew = false;           // at the blade's next place; the cut before was refused
  double owed_m = 0;                  // from the end of the cut to the blade, which the cut can't follow
  bool has_dragged_end = false;       // the blade took the end of the cut along to its next place

  template <class A>
  void archive(A& a) {
    a(depth_m, at_world_m, on_lid_body_m, was_away, begins_anew, owed_m, has_dragged_end);
  }
};

// A vertex of the temporary subdivision moves like any other. It begins where the subdivision puts it, and has drifted
// when that is undone.
struct Drift {
  Vec3 way_world_m = Vec3::Zero(), velocity_world_m_per_s = Vec3::Zero();

  static Drift between(const VertexState& from, const VertexState& to) {
    return {to.position_world_m - from.position_world_m, to.velocity_world_m_per_s - from.velocity_world_m_per_s};
  }
  static Drift mix(const Drift& a, const Drift& b, double s) {
    return {(1 - s) * a.way_world_m + s * b.way_world_m,
            (1 - s) * a.velocity_world_m_per_s + s * b.velocity_world_m_per_s};
  }
  VertexState from(VertexState state) const {
    state.position_world_m += way_world_m;
    state.velocity_world_m_per_s += velocity_world_m_per_s;
    return state;
  }

  template <class A>
  void archive(A& a) {
    a(way_world_m, velocity_world_m_per_s);
  }
};

struct Stroke {
  std::uint32_t edge_id = 0;
  BladeSeen seen;
  Cell cell;                                             // apex == kNone: no cut is under way
  std::array<VertexId, 3> touched{kNone, kNone, kNone};  // corners of the triangle in which it began, or that it is at
  Vec3 bary{1, 0, 0};                                    // place of the cut's end in cell.corners(), or in `touched`
  VertexId start = kNone;   // a cut that is scored but not open has the two points start and apex
  VertexId bottom = kNone;  // beneath the apex; kNone: not open yet
  std::optional<VertexState> start_bottom, apex_bottom;  // bottoms of points that are not open yet
  VertexId first = kNone;                                // the first vertex of the cut, at which a loop closes
  std::uint32_t points = 0;                              // permanent points so far
  double length_m = 0;                                   // length of the permanent cut, at rest
  std::optional<Blade> blade;                            // the last pose at which it cut
  std::string_view why_refused;                          // for a person
  Vec3 heading_body = Vec3::Zero();  // unit, at rest, of the permanent cut at the apex; zero: unknown
  std::vector<Vec3> behind_body_m;   // the last points of the cut at rest, which it can't run into
  bool has_moved = false;            // in this step
  // The halves of vertices at which cuts have met in this step: a loop may have closed.
  std::vector<std::array<VertexId, 2>> met;

  // The states of the apex's halves, while the temporary subdivision is undone; the apex is then between them.
  std::optional<std::array<VertexState, 2>> lips;

  // The temporary subdivision. One that is made anew begins on the surface as the one before has left it, not as the
  // surface would be without any: springs that have given way would be stretched again at each step of the blade, and
  // drive the vertices around the end of the cut to and fro. The tip drifts from its place in the cell, the bottom from
  // its place under the tip.
  Drift tip_drift, bottom_drift;
  Cell temporary_cell;                 // with the tip
  Vec3 temporary_bary = Vec3::Zero();  // its place in the cell
  std::optional<TopologyDelta> temporary_inverse;
  VertexId temporary_tip = kNone;
  VertexId temporary_twin = kNone;                       // the other half of the apex; kNone: the apex is not divided
  std::array<VertexId, 2> temporary_pair{kNone, kNone};  // the halves of the vertex that is divided
  std::vector<VertexId> temporary_bottoms;  // the last one is under the tip; three when the cut opened with it

  bool cuts() const { return cell.apex != kNone; }

  // It goes on as a branch from a vertex of a lip, its apex, which is at this place at rest.
  void branches_from(const Vec3& place_body_m, VertexId bottom_there) {
    bottom = bottom_there;
    start = first = kNone;
    temporary_cell = {};
    points = 1;
    length_m = 0;
    lips.reset();
    behind_body_m = {place_body_m};
  }

  template <class A>
  void archive(A& a) {
    a(edge_id, seen, cell, touched, bary, start, bottom, start_bottom, apex_bottom, first, points, length_m, blade,
      why_refused, heading_body, behind_body_m, has_moved, met, lips, tip_drift, bottom_drift, temporary_cell,
      temporary_bary, temporary_inverse, temporary_tip, temporary_twin, temporary_pair, temporary_bottoms);
  }
};

// The place of the instrument, by the draft's state of the cell.
Vec3 position_of(const MeshDraft& draft, const Stroke& stroke);
// The same point at rest.
Vec3 rest_of(const MeshDraft& draft, const Stroke& stroke);
// Unit normal of the surface there at rest, out of the tissue: a dent does not turn it. Zero when there is no cell.
Vec3 rest_normal_of(const MeshDraft& draft, const Stroke& stroke);

// Undoes the temporary subdivision. False when the mesh has changed under it.
bool undo_temporary(MeshDraft& draft, Stroke& stroke);

// Moves the instrument to `blade` and cuts what lies on the way at rest, over the surface, triangle by triangle, so
// that no triangle is skipped. `near`: triangles that the blade's line may cross. The draft must be without temporary
// subdivisions. Refused: the draft must be dropped.
StrokeEnd advance(MeshDraft& draft, Stroke& stroke, const Blade& blade, std::span<const TriangleId> near,
                  Grooves& grooves, const StrokeSettings& settings);

// Opens the cut up to the instrument, temporarily. False when there is no valid subdivision.
bool open_temporarily(MeshDraft& draft, Stroke& stroke, const StrokeSettings& settings);

// Ends the cut that the blade works on: its opening stays (figure 10, P4), and later cuts can join its ends. Takes a
// draft without the temporary subdivision unless the stroke still has it.
bool finish(MeshDraft& draft, Stroke& stroke, Grooves& grooves);

// Ends a cut without a change of the mesh. False when nothing of the cut is open.
bool keep_what_is_open(Stroke& stroke, Grooves& grooves);

// The record with the temporary subdivision of a stroke, as if that were permanent.
void add_temporary(const Stroke& stroke, Grooves& grooves);

}  // namespace sectio
