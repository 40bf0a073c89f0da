#include "sim_server/surface/cutting/stroke.h"

#include <algorithm>
#include <cmath>

#include "common/math/frame.h"
#include "common/math/intersect.h"
#include "sim_server/surface/cutting/stroke_walk.h"

namespace sectio {
namespace {

std::array<VertexState, 3> corner_states(const MeshDraft& draft, const std::array<VertexId, 3>& corners) {
  return {draft.state(corners[0]), draft.state(corners[1]), draft.state(corners[2])};
}

std::array<VertexId, 3> corners_of(const Stroke& stroke) {
  return stroke.cell.apex == kNone ? stroke.touched : stroke.cell.corners();
}

// The corners of the cell that the instrument is in. Lips that have drawn apart would shear the cell, so the apex
// counts as lying between them.
std::array<VertexState, 3> corner_states(const MeshDraft& draft, const Stroke& stroke) {
  auto c = corner_states(draft, corners_of(stroke));
  if (stroke.temporary_twin != kNone && stroke.cell.rim.size() == 2)
    c[0] = VertexState::mix(c[0], draft.state(stroke.temporary_twin), 0.5);
  return c;
}

VertexState state_at(const MeshDraft& draft, const Stroke& stroke) {
  if (stroke.cell.apex != kNone && stroke.cell.rim.empty()) return draft.state(stroke.cell.apex);
  return VertexState::mix(corner_states(draft, stroke), stroke.bary);
}

// A point pulled into the triangle, so that the subdivision around it has no sliver.
Vec3 inset(const Vec3& bary, double least) {
  Vec3 b = bary.cwiseMax(least);
  return b / b.sum();
}

}  // namespace

void part_lips(MeshDraft& draft, Stroke& stroke, VertexId twin) {
  if (!stroke.lips) return;
  draft.move_vertex(stroke.cell.apex, (*stroke.lips)[0]);
  draft.move_vertex(twin, (*stroke.lips)[1]);
  stroke.lips.reset();
}

VertexState bottom_under(const MeshDraft& draft, const std::array<VertexId, 3>& corners, const VertexState& surface,
                         const Blade& blade, const StrokeSettings& settings) {
  const double tip_depth_m = (surface.position_world_m - blade.tip_world_m).dot(blade.up_world);
  const double depth_m = std::max(settings.min_depth_m, std::min(tip_depth_m, blade.max_depth_m));
  const Vec3 down_world = -depth_m * blade.up_world;
  Vec3 down_rest = -depth_m * blade.up_body;
  if (blade.up_body.isZero()) {
    const auto c = corner_states(draft, corners);
    const Mat3 world = frame_of(c[0].position_world_m, c[1].position_world_m, c[2].position_world_m);
    const Mat3 rest = frame_of(c[0].rest_body_m, c[1].rest_body_m, c[2].rest_body_m);
    down_rest = rest * (world.transpose() * down_world);
  }
  return {surface.rest_body_m + down_rest, surface.position_world_m + down_world, surface.velocity_world_m_per_s};
}

Vec3 position_of(const MeshDraft& draft, const Stroke& stroke) {
  return state_at(draft, stroke).position_world_m;
}

Vec3 rest_of(const MeshDraft& draft, const Stroke& stroke) {
  return state_at(draft, stroke).rest_body_m;
}

Vec3 rest_normal_of(const MeshDraft& draft, const Stroke& stroke) {
  if (stroke.cell.apex != kNone && stroke.cell.rim.empty()) return Vec3::Zero();
  const auto c = corner_states(draft, stroke);
  return (c[1].rest_body_m - c[0].rest_body_m).cross(c[2].rest_body_m - c[0].rest_body_m).stableNormalized();
}

bool undo_temporary(MeshDraft& draft, Stroke& stroke) {
  if (!stroke.temporary_inverse) return true;
  if (stroke.temporary_twin != kNone) {
    stroke.lips = {draft.state(stroke.cell.apex), draft.state(stroke.temporary_twin)};
    draft.move_vertex(stroke.cell.apex, VertexState::mix((*stroke.lips)[0], (*stroke.lips)[1], 0.5));
  }
  stroke.temporary_twin = kNone;
  return draft.undo(*stroke.temporary_inverse);
}

bool open_temporarily(MeshDraft& draft, Stroke& stroke, const StrokeSettings& settings) {
  stroke.temporary_inverse.reset();
  stroke.temporary_tip = stroke.temporary_twin = kNone;
  stroke.temporary_bottoms.clear();
  if (!stroke.cuts() || stroke.cell.rim.empty() || !stroke.blade) return true;
  const Blade& blade = *stroke.blade;

  Stroke here = stroke;  // the temporary subdivision of another instrument may be in the same cell
  if (!settle(draft, here)) return false;
  draft.mark();
  const auto corners = here.cell.corners();
  const VertexState tip = VertexState::mix(corner_states(draft, corners), inset(here.bary, settings.inset));
  const VertexState bottom = bottom_under(draft, corners, tip, blade, settings);
  const VertexId q = insert_in_cell(draft, here.cell, tip);
  if (q == kNone) return false;
  if (stroke.bottom != kNone) {
    const auto extension = extend(draft, stroke.cell.apex, stroke.bottom, q, bottom);
    if (!extension) return false;
    stroke.temporary_twin = extension->twin;
    stroke.temporary_pair = {stroke.cell.apex, extension->twin};
    stroke.temporary_bottoms = {extension->bottom};
  } else {
    VertexId start = stroke.start, middle = stroke.cell.apex;
    VertexState middle_bottom;
    if (start == kNone) {  // both ends of the cut are in this triangle, so no edge is active
      start = stroke.cell.apex;
      middle = insert_on_edge(draft, start, q, VertexState::mix(draft.state(start), draft.state(q), 0.5));
      if (middle == kNone) return false;
      middle_bottom = VertexState::mix(*stroke.start_bottom, bottom, 0.5);
    } else {
      middle_bottom = *stroke.apex_bottom;
    }
    const auto opening = open_start(draft, start, middle, q, {*stroke.start_bottom, middle_bottom, bottom});
    if (!opening) return false;
    if (stroke.start != kNone) stroke.temporary_twin = opening->twin;
    stroke.temporary_pair = {middle, opening->twin};
    stroke.temporary_bottoms.assign(opening->bottom.begin(), opening->bottom.end());
  }
  if (stroke.temporary_twin != kNone) part_lips(draft, stroke, stroke.temporary_twin);
  stroke.lips.reset();
  stroke.temporary_tip = q;
  stroke.temporary_inverse = draft.inverse_since_mark();
  return true;
}

}  // namespace sectio
