// The way of a cut over the surface at rest, from its end to a place or to a vertex.
#pragma once

#include "sim_server/surface/cutting/stroke.h"

namespace sectio {

// The bottom of the groove under a surface point: on the line of the blade, at most as deep as tip and tissue allow.
VertexState bottom_under(const MeshDraft& draft, const std::array<VertexId, 3>& corners, const VertexState& surface,
                         const Blade& blade, const StrokeSettings& settings);
// The drift of the bottom beneath the apex from its place under the apex.
Drift drift_of_last_bottom(const MeshDraft& draft, const Stroke& stroke, const Blade& blade);

// Moves the halves of a split apex to their places before the temporary subdivision was undone.
void part_lips(MeshDraft& draft, Stroke& stroke, VertexId twin);

// Finds the end of the cut again when another cut has changed the cell, as near as the fan of the apex allows, or with
// `grooves` those of all vertices that cuts have made of it: the stroke then goes on as a branch. Without them while
// temporary subdivisions are there, which divide the apex for a step. False when nothing is left of the cell.
bool settle(const MeshDraft& draft, Stroke& stroke, const Grooves* grooves = nullptr);

// No cut is under way any more; the blade is at the skin beside a vertex.
void stand_beside(const MeshDraft& draft, Stroke& stroke, VertexId v);

struct WalkTarget {
  Vec3 rest_body_m = Vec3::Zero();
  VertexId vertex = kNone;          // vertex of a lip, or at the end of a cut, which the cut joins
  Vec3 normal_body = Vec3::Zero();  // unit, of the skin there at rest; zero: as where the cut ends
};

enum class WalkEnd : std::uint8_t {
  there,
  waits,   // the surface doesn't lead there yet
  joined,  // ran into a cut: no cut is under way any more
  refused,
};

// Makes the cut permanent up to the cell that contains the target, and moves the end of the cut there.
WalkEnd walk(MeshDraft& draft, Stroke& stroke, const Blade& blade, Grooves& grooves, const StrokeSettings& settings,
             const WalkTarget& target);

// The rung at a place of a lip: the nearer of the lip's ends that `takes` (vertex, distance as a ratio of the lip's
// length), else a new one there, or the nearer end where none can be made.
template <class Takes>
VertexId rung_at(MeshDraft& draft, Grooves& grooves, const Lip& lip, double along, const Takes& takes) {
  const bool is_from = along < 0.5;
  const VertexId near = is_from ? lip.from : lip.to, far = is_from ? lip.to : lip.from;
  const double away = is_from ? along : 1 - along;
  if (takes(near, away)) return near;
  if (takes(far, 1 - away)) return far;
  const VertexId made = insert_rung(draft, grooves, lip, along);
  return made != kNone ? made : near;
}

// Makes a vertex of a lip, or one of its twins, the apex of a cut towards a place. False when no skin leads there.
bool branch_off(const MeshDraft& draft, Stroke& stroke, const Grooves& grooves, VertexId lip, const Vec3& to_body_m);

}  // namespace sectio
