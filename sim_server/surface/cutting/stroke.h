// The cut of one instrument in one body while it lasts: progressive cutting with temporary subdivision (paper B, 5.1).
//
// The permanent part of the cut ends at the apex of the cell that contains the instrument. Inside the cell the cut
// follows the instrument by a temporary subdivision, which is undone before anything else is planned. When the
// instrument leaves the cell, the cut through it becomes a straight line from entry to exit (figure 1).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "sim_server/surface/cutting/grooves.h"
#include "sim_server/surface/cutting/templates.h"

namespace sectio {

// The line of an instrument that cuts, at one pose: from the tip upwards along the sharp edge (paper B, figure 3: A to
// C; a cautery hook: D to C).
struct Blade {
  Vec3 tip_world_m = Vec3::Zero();
  Vec3 up_world = Vec3::UnitZ();  // unit
  double max_depth_m = 1e9;       // largest depth of the groove that the tissue's thickness allows
  Vec3 up_body = Vec3::Zero();    // up_world in the frame of the tissue at rest; zero: as the triangle has turned
  double length_m = 1e9;          // of the sharp edge
};

// The two ways to cut a surface; a scene chooses one.
enum class CutStyle : std::uint8_t {
  progressive,  // paper B: the groove follows the tip, and its lips are closed until springs part them
  templates,    // paper A: the opening has a width, and goes through the body if the blade does (template_cut.h)
};

struct StrokeSettings {
  CutStyle style = CutStyle::progressive;
  double open_top_m = 4e-4, open_bottom_m = 2e-4;  // templates only: widths of the opening
  double snap_ratio = 0.08;   // a crossing this close to a corner of its edge (ratio of its length) goes through it
  double inset = 0.04;        // least barycentric coordinate of a vertex inside a triangle
  double min_step_m = 1e-4;   // motion of the instrument before a cut opens
  double min_depth_m = 3e-4;  // least depth of a groove
  double release_depth_m = -2e-4;  // the stroke ends when the depth of the tip is below this
  double join_tolerance_m = 2e-3;
};

enum class StrokeEnd : std::uint8_t {
  going,    // nothing ended
  lifted,   // the blade is out of the tissue, or through it
  joined,   // ran into the end of a cut
  lost,     // the surface does not lead to the instrument: search anew
  refused,  // no valid subdivision
};

struct Stroke {
  std::uint32_t edge_id = 0;
  Cell cell;                                             // apex == kNone: the instrument has only touched so far
  std::array<VertexId, 3> touched{kNone, kNone, kNone};  // corners of the triangle in which it began
  Vec3 bary{1, 0, 0};                                    // place of the instrument in cell.corners(), or in `touched`
  VertexId start = kNone;   // a cut that is scored but not open has the two points start and apex
  VertexId bottom = kNone;  // beneath the apex; kNone: not open yet
  std::optional<VertexState> start_bottom, apex_bottom;  // bottoms of points that are not open yet
  VertexId first = kNone;                                // the first vertex of the cut, at which a loop closes
  std::uint32_t points = 0;                              // permanent points so far
  double depth_m = 0;                                    // depth of the tip below the surface
  std::optional<Blade> blade;                            // the last pose at which it cut
  std::string_view why_refused;                          // for a person
  VertexId joined_twin = kNone;                          // the other half of the apex, once the cut has joined another

  // The states of the apex's halves, while the temporary subdivision is undone; the apex is then between them.
  std::optional<std::array<VertexState, 2>> lips;

  // The temporary subdivision.
  std::optional<TopologyDelta> temporary_inverse;
  VertexId temporary_tip = kNone;
  VertexId temporary_twin = kNone;          // the other half of the apex; kNone: the apex is not divided
  std::vector<VertexId> temporary_bottoms;  // the last one is under the tip; three when the cut opened with it
};

// The place of the instrument, by the draft's state of the cell.
Vec3 position_of(const MeshDraft& draft, const Stroke& stroke);
// The same point at rest.
Vec3 rest_of(const MeshDraft& draft, const Stroke& stroke);
// Unit normal of the surface there at rest, out of the tissue: a dent does not turn it. Zero when there is no cell.
Vec3 rest_normal_of(const MeshDraft& draft, const Stroke& stroke);

struct SurfacePoint {
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Zero();
};
// The point of the given triangles that is nearest to a point; kNone if there are no triangles.
SurfacePoint nearest_on(const MeshDraft& draft, std::span<const TriangleId> triangles, const Vec3& point_world_m);

// Undoes the temporary subdivision. False when the mesh has changed under it.
bool undo_temporary(MeshDraft& draft, Stroke& stroke);

// Moves the instrument to `blade` and cuts all that lies on the way, over the surface in the plane of the motion,
// triangle by triangle, so that no triangle is skipped. The draft must be without the stroke's temporary subdivision.
StrokeEnd advance(MeshDraft& draft, Stroke& stroke, const Blade& blade, GrooveDraft& grooves,
                  const StrokeSettings& settings);

// Opens the cut up to the instrument, temporarily. False when there is no valid subdivision.
bool open_temporarily(MeshDraft& draft, Stroke& stroke, const Blade& blade, const StrokeSettings& settings);

// Ends the stroke of an instrument that was lifted: its opening stays (figure 10, P4), and later cuts can join its
// ends. Takes a draft without the temporary subdivision unless the stroke still has it.
bool finish(MeshDraft& draft, Stroke& stroke, GrooveDraft& grooves);

// Ends a stroke without a change of the mesh. False when nothing of the cut is open.
bool keep_what_is_open(Stroke& stroke, GrooveDraft& grooves);

}  // namespace sectio
