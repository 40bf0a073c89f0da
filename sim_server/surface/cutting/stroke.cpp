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

// A point of a cell, whose apex may have left the plane of the corners. A cell whose apex divides an edge is two faces:
//
//     u --- apex --- w        s: where the line from y over the point meets the edge
//      \     |     /          t: the apex along the edge
//        \   |   /
//            y                s < t: the point lies in (u, apex, y), else in (apex, w, y)
VertexState point_of(const MeshDraft& draft, const Cell& cell, const VertexState& apex, const Vec3& bary) {
  if (cell.rim.empty()) return apex;
  const VertexState u = draft.state(cell.rim[0]), y = draft.state(cell.rim[1]);
  if (cell.rim.size() == 2) return VertexState::mix({apex, u, y}, bary);
  const VertexState w = draft.state(cell.rim[2]);
  const Vec3 edge_m = w.rest_body_m - u.rest_body_m;
  const double t = (apex.rest_body_m - u.rest_body_m).dot(edge_m) / edge_m.squaredNorm();
  const double share = bary[0] + bary[2], s = share > 0 ? bary[2] / share : t;
  const VertexState at_edge =
      s < t ? VertexState::mix(u, apex, s / t) : VertexState::mix(apex, w, t < 1 ? (s - t) / (1 - t) : 1.0);
  return VertexState::mix(y, at_edge, share);
}

// Lips that have drawn apart would shear the cell, so the apex counts as lying between them.
VertexState state_at(const MeshDraft& draft, const Stroke& stroke) {
  if (!stroke.cuts()) return VertexState::mix(corner_states(draft, stroke.touched), stroke.bary);
  VertexState apex = draft.state(stroke.cell.apex);
  if (stroke.temporary_twin != kNone) apex = VertexState::mix(apex, draft.state(stroke.temporary_twin), 0.5);
  return point_of(draft, stroke.cell, apex, stroke.bary);
}

// The share of the last tip's drift at a point of a cell: 1 at that tip, 0 at the edges of the cell, linear in between.
double share_of_drift(const Stroke& stroke, const Cell& cell, const Vec3& bary) {
  const bool is_same = cell.apex == stroke.temporary_cell.apex && cell.rim == stroke.temporary_cell.rim;
  return is_same ? std::min(1.0, (bary.array() / stroke.temporary_bary.array()).minCoeff()) : 0.0;
}

Drift drift_from_under(const VertexState& top, const VertexState& bottom, const Blade& blade) {
  Drift drift = Drift::between(top, bottom);
  drift.way_world_m += (top.rest_body_m - bottom.rest_body_m).norm() * blade.up_world;
  return drift;
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

Drift drift_of_last_bottom(const MeshDraft& draft, const Stroke& stroke, const Blade& blade) {
  if (stroke.bottom == kNone) return {};
  return drift_from_under(draft.state(stroke.cell.apex), draft.state(stroke.bottom), blade);
}

Vec3 position_of(const MeshDraft& draft, const Stroke& stroke) {
  return state_at(draft, stroke).position_world_m;
}

Vec3 rest_of(const MeshDraft& draft, const Stroke& stroke) {
  return state_at(draft, stroke).rest_body_m;
}

Vec3 rest_normal_of(const MeshDraft& draft, const Stroke& stroke) {
  if (stroke.cell.apex != kNone && stroke.cell.rim.empty()) return Vec3::Zero();
  const auto c = corner_states(draft, stroke.cuts() ? stroke.cell.corners() : stroke.touched);
  return (c[1].rest_body_m - c[0].rest_body_m).cross(c[2].rest_body_m - c[0].rest_body_m).stableNormalized();
}

bool undo_temporary(MeshDraft& draft, Stroke& stroke) {
  if (!stroke.temporary_inverse) return true;
  if (stroke.temporary_twin != kNone) {
    stroke.lips = {draft.state(stroke.cell.apex), draft.state(stroke.temporary_twin)};
    draft.move_vertex(stroke.cell.apex, VertexState::mix((*stroke.lips)[0], (*stroke.lips)[1], 0.5));
  }
  stroke.temporary_twin = kNone;
  const VertexState tip = draft.state(stroke.temporary_tip), bottom = draft.state(stroke.temporary_bottoms.back());
  if (!draft.undo(*stroke.temporary_inverse)) return false;
  const Cell& cell = stroke.temporary_cell;
  stroke.tip_drift = Drift::between(point_of(draft, cell, draft.state(cell.apex), stroke.temporary_bary), tip);
  stroke.bottom_drift = drift_from_under(tip, bottom, *stroke.blade);
  return true;
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
  const Vec3 bary = inset(here.bary, settings.inset);
  const double share = share_of_drift(stroke, here.cell, bary);
  const VertexState tip =
      Drift::mix({}, stroke.tip_drift, share).from(point_of(draft, here.cell, draft.state(here.cell.apex), bary));
  const VertexState bottom = Drift::mix(drift_of_last_bottom(draft, here, blade), stroke.bottom_drift, share)
                                 .from(bottom_under(draft, corners, tip, blade, settings));
  stroke.temporary_cell = here.cell;
  stroke.temporary_bary = bary;
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
