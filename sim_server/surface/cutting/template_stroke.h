// Cuts with templates as sequences of steps (paper A, section 2.3, figures 6 and 7), on a draft: one that rests and
// goes on is the one that never rested.
#pragma once

#include "sim_server/surface/cutting/template_cut.h"

namespace sectio {

// A cut of bottom faces along an old groove: bottoms that the trail of the tip passes beneath go down to it. The old
// bottom faces are discarded and sides adjusted in that their vertices move: no triangle is added. How many moved.
std::size_t deepen_groove(MeshDraft& draft, const RestBlade& first, const RestBlade& last, const GrooveDraft& grooves,
                          std::span<const TriangleId> active, const TemplateSettings& settings);

// One instrument's cut in one body while it lasts. Within the face that the instrument is in the cut is temporary:
// undone and made again by every step, so a cut that rests and goes on is the one that never rested, and a face is
// subdivided once however many steps it takes to cross it.
struct TemplateStroke {
  std::uint32_t tool_id = 0;
  std::array<VertexId, 3> touched{kNone, kNone, kNone};  // corners of the triangle where it began, and where in it
  Vec3 bary = Vec3::UnitX();
  std::vector<CutFront> fronts;             // of what is permanent
  std::optional<RestBlade> at_front;        // pose there, or where the stroke began
  std::optional<RestBlade> newest;          // pose
  std::optional<Blade> blade;               // the same in the world
  std::optional<Vec3> displacement_body_m;  // of the tissue at the instrument from its place at rest, smoothed
  std::string_view why_refused;             // for a person
  bool waits = false;                       // until the blade is at the end of the groove that it goes on with
  std::vector<TriangleId> active;           // that the temporary part began with
  TargetStates bottoms_at_tip;              // of permanent bottoms
  std::vector<ActiveFace> faces;            // that became permanent in the last step
  std::optional<TopologyDelta> temporary_inverse;
  std::vector<std::pair<VertexId, Vec3>> temporarily_moved;  // world, metres: back when it is undone
  std::vector<CutFront> temporary_fronts, temporary_starts;
  TargetStates temporary_bottoms_at_tip;
  std::set<VertexId> temporary_bottoms;
};

enum class TemplateStrokeEnd : std::uint8_t { going, left_body, joined, refused };

// Takes back the temporary part. False when the mesh has changed under it.
[[nodiscard]] bool undo_temporary(MeshDraft& draft, TemplateStroke& stroke);

// The bottoms born in the step before go to where the tip was.
void take_bottoms_to_tip(MeshDraft& draft, TemplateStroke& stroke);

// On a draft without temporary parts: the bottoms born in the step before go to where the tip was, then what lies
// between the front and the last edge that the blade has crossed becomes permanent. A stroke begins at the end of an
// old groove if there is one, and joins one that it comes to: its own, another's, or one that is being cut.
TemplateStrokeEnd advance(MeshDraft& draft, TemplateStroke& stroke, const RestBlade& blade,
                          std::span<const TriangleId> active, GrooveDraft& grooves, const TemplateSettings& settings);

// From there to the blade.
void open_temporarily(MeshDraft& draft, TemplateStroke& stroke, const TemplateSettings& settings);

// The instrument was lifted: what is open stays, its last bottoms go to where the tip was.
void finish(MeshDraft& draft, TemplateStroke& stroke, GrooveDraft& grooves);

// The same where the mesh must not change any more.
void keep_what_is_open(const TemplateStroke& stroke, GrooveDraft& grooves);

}  // namespace sectio
