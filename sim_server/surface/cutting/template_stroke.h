// Cuts with templates as sequences of steps on a draft (paper A, section 2.3, figures 6 and 7). A cut that rests and
// goes on gives the same mesh as one that never rested.
#pragma once

#include <algorithm>

#include "sim_server/surface/cutting/template_cut.h"

namespace sectio {

// Cuts the bottom faces of an old groove: bottoms that the trail of the tip passes beneath move down to the trail, and
// no triangle is added. Returns the number of vertices that moved.
std::size_t deepen_groove(MeshDraft& draft, const RestBlade& first, const RestBlade& last, const Grooves& grooves,
                          std::span<const TriangleId> active, const TemplateSettings& settings);

// The place of an instrument on the surface, for everything else in the simulation.
struct PlaceOfStroke {
  std::array<VertexId, 3> corners{kNone, kNone, kNone};
  Vec3 bary = Vec3::UnitX();
  VertexId top = kNone;               // the upper end of the cut; kNone: it has cut nothing yet
  Vec3 point_world_m = Vec3::Zero();  // the tissue around the cut takes it there: a lip may swing about

  bool stands_on(VertexId v) const { return v == top || std::ranges::find(corners, v) != corners.end(); }

  template <class A>
  void archive(A& a) {
    a(corners, bary, top, point_world_m);
  }
};

// One instrument's cut in one body while it lasts. Within the face that the instrument is in the cut is temporary:
// every step undoes it and makes it again, so that a face is divided once, however many steps the instrument takes to
// cross it.
struct TemplateStroke {
  std::uint32_t edge_id = 0;
  std::array<VertexId, 3> touched{kNone, kNone, kNone};  // the triangle in which it began, with bary
  Vec3 bary = Vec3::UnitX();
  std::optional<Vec3> entered_body_m;  // the same place at rest
  bool begins_at_wall = false;
  std::vector<CutFront> fronts;             // fronts of the permanent part
  std::optional<RestBlade> at_front;        // pose at the front, or at the beginning of the stroke
  std::optional<RestBlade> newest;          // newest pose
  std::optional<Blade> blade;               // newest pose in the world
  std::optional<Vec3> displacement_body_m;  // way of the tissue at the instrument from its place at rest, smoothed
  std::optional<Pose> frame_world;          // frame of the body at the instrument
  std::optional<Vec3> stuck_since_body_m;   // tip at the first of the steps that were impossible
  std::string_view why_refused;             // for a person
  bool waits = false;                       // it waits for the blade to reach the end of the groove that it continues
  std::vector<TriangleId> active;           // triangles with which the temporary part began
  TargetStates bottoms_at_tip;              // places for the permanent bottoms
  std::vector<ActiveFace> faces;            // faces that became permanent in the last step
  std::optional<TopologyDelta> temporary_inverse;
  std::vector<std::pair<VertexId, Vec3>> temporarily_moved;      // former positions in the world, restored by undo
  std::vector<std::pair<VertexId, VertexState>> last_temporary;  // vertices of the temporary part when it was undone
  std::vector<CutFront> temporary_fronts, temporary_starts;
  TargetStates temporary_bottoms_at_tip;
  std::set<VertexId> temporary_bottoms;
  PlaceOfStroke place;  // with the temporary part

  template <class A>
  void archive(A& a) {
    a(edge_id, touched, bary, entered_body_m, begins_at_wall, fronts, at_front, newest, blade, displacement_body_m,
      frame_world, stuck_since_body_m, why_refused, waits, active, bottoms_at_tip, faces, temporary_inverse,
      temporarily_moved, last_temporary, temporary_fronts, temporary_starts, temporary_bottoms_at_tip,
      temporary_bottoms, place);
  }
};

enum class TemplateStrokeEnd : std::uint8_t { going, left_body, joined, refused };

// Undoes the temporary part. False when the mesh has changed under it.
[[nodiscard]] bool undo_temporary(MeshDraft& draft, TemplateStroke& stroke);

// Moves the bottoms that the step before made to the tip's place in that step.
void take_bottoms_to_tip(MeshDraft& draft, TemplateStroke& stroke);

// Works on a draft without temporary parts: moves the bottoms that the step before made to the tip's place, then makes
// the cut between the front and the last edge that the blade has crossed permanent. A stroke begins at the end of an
// old groove if there is one, and joins a groove that it comes to: its own, an older one, or one that is being cut.
TemplateStrokeEnd advance(MeshDraft& draft, TemplateStroke& stroke, const RestBlade& blade,
                          std::span<const TriangleId> active, Grooves& grooves, const TemplateSettings& settings);

// Opens the cut from its front to the blade, temporarily.
void open_temporarily(MeshDraft& draft, TemplateStroke& stroke, const TemplateSettings& settings);

// Ends the stroke of an instrument that was lifted: its opening stays, and its last bottoms move to the tip's place.
void finish(MeshDraft& draft, TemplateStroke& stroke, Grooves& grooves);

// Ends a stroke without a change of the mesh.
void keep_what_is_open(const TemplateStroke& stroke, Grooves& grooves);

}  // namespace sectio
