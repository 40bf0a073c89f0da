#include "sim_server/surface/cutting/stroke.h"

#include <algorithm>
#include <cmath>

#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr int kMaxCellsPerStep = 100000;

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

// Moves the halves of a split apex to their places before the temporary subdivision was undone.
void part_lips(MeshDraft& draft, Stroke& stroke, VertexId twin) {
  if (!stroke.lips) return;
  draft.move_vertex(stroke.cell.apex, (*stroke.lips)[0]);
  draft.move_vertex(twin, (*stroke.lips)[1]);
  stroke.lips.reset();
}

// A frame whose columns are the first edge, the direction across it, and the normal.
Mat3 frame_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 e = (b - a).stableNormalized();
  const Vec3 n = (b - a).cross(c - a).stableNormalized();
  Mat3 f;
  f << e, n.cross(e), n;
  return f;
}

// The bottom of the groove under a surface point: on the line of the blade, not deeper than the tip or the tissue
// allow. The rotation of the triangle that contains the instrument takes it to the rest shape.
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

// The vertical plane through the last and the present place of the instrument, and its progress in that plane.
struct SweepPlane {
  Vec3 origin, ahead, left;
  Vec3 blade_point;

  SweepPlane(const Vec3& from, const Blade& blade) : origin(from), blade_point(blade.tip_world_m) {
    const Vec3 to = blade.tip_world_m - from;
    ahead = to - to.dot(blade.up_world) * blade.up_world;
    distance_m = ahead.norm();
    if (distance_m > 0) ahead /= distance_m;
    left = blade.up_world.cross(ahead);
  }
  double side(const Vec3& x) const { return left.dot(x - origin); }            // > 0: to the left
  double progress(const Vec3& x) const { return ahead.dot(x - blade_point); }  // >= 0: the blade has not reached x

  double distance_m = 0;
};

// The exit of the plane from a triangle that it entered: the one edge that it crosses from right to left.
struct Exit {
  int edge = -1;
  double t = 0;  // along the edge
};

Exit exit_of(const std::array<VertexState, 3>& corners, const SweepPlane& plane) {
  std::array<double, 3> s;
  for (std::size_t i = 0; i < 3; ++i) s[i] = plane.side(corners[i].position_world_m);
  for (std::size_t i = 0; i < 3; ++i) {
    const double s_from = s[i], s_to = s[(i + 1) % 3];
    if (s_from < 0 && s_to >= 0) return {static_cast<int>(i), s_from / (s_from - s_to)};
  }
  return {};
}

Vec3 edge_bary(const Exit& exit) {
  Vec3 b = Vec3::Zero();
  b[exit.edge] = 1 - exit.t;
  b[(exit.edge + 1) % 3] = exit.t;
  return b;
}

Cell cell_of_triangle(const Triangle& t, VertexId apex) {
  const int i = t.corner_of(apex);
  return {apex, {t.v[static_cast<std::size_t>((i + 1) % 3)], t.v[static_cast<std::size_t>((i + 2) % 3)]}};
}

// The triangle of the fan of `apex` into which the plane leads, excluding those of the groove behind.
std::optional<Cell> cell_ahead(const MeshDraft& draft, VertexId apex, VertexId bottom, const SweepPlane& plane) {
  std::optional<Cell> best;
  double best_progress = plane.progress(draft.position(apex)) - 1e-12;
  for (const TriangleId t : draft.fan(apex)) {
    const Triangle triangle = draft.triangle(t);
    if (bottom != kNone && triangle.corner_of(bottom) >= 0) continue;
    const Cell cell = cell_of_triangle(triangle, apex);
    const Vec3 u = draft.position(cell.rim[0]), w = draft.position(cell.rim[1]);
    const double s_u = plane.side(u), s_w = plane.side(w);
    if (!(s_u < 0 && s_w >= 0)) continue;
    const double progress = plane.progress(u + s_u / (s_u - s_w) * (w - u));
    if (progress <= best_progress) continue;
    best = cell;
    best_progress = progress;
  }
  return best;
}

// Finds the instrument's place again when another cut has changed the cell, as near as the fan of the apex allows.
// False when nothing is left of the cell.
bool settle(const MeshDraft& draft, Stroke& stroke) {
  const VertexId apex = stroke.cell.apex;
  if (apex == kNone) return draft.find_triangle(stroke.touched[0], stroke.touched[1], stroke.touched[2]) != kNone;
  if (!triangles_of(draft, stroke.cell).empty()) return true;
  std::vector<TriangleId> around = draft.fan(apex);
  std::erase_if(
      around, [&](TriangleId t) { return stroke.bottom != kNone && draft.triangle(t).corner_of(stroke.bottom) >= 0; });
  const SurfacePoint at = nearest_on(draft, around, position_of(draft, stroke));
  if (at.triangle == kNone) return false;
  const Triangle triangle = draft.triangle(at.triangle);
  stroke.cell = cell_of_triangle(triangle, apex);
  const int first = triangle.corner_of(apex);
  stroke.bary = {at.bary[first], at.bary[(first + 1) % 3], at.bary[(first + 2) % 3]};
  return true;
}

class Walk {
 public:
  Walk(MeshDraft& draft, Stroke& stroke, const Blade& blade, GrooveDraft& grooves, const StrokeSettings& settings)
      : draft_(draft),
        stroke_(stroke),
        blade_(blade),
        grooves_(grooves),
        settings_(settings),
        plane_(position_of(draft, stroke), blade) {}

  StrokeEnd run() {
    if (stroke_.cell.apex == kNone) {
      if (plane_.distance_m < settings_.min_step_m) return ended_by_depth();
      if (!begin()) return refuse("the surface can't be divided where the cut begins");
    }
    if (plane_.distance_m < 1e-9) return ended_by_depth();
    if (stroke_.cell.rim.size() == 2 && stroke_.bary[0] == 1 && !enter_at(stroke_.cell.apex)) {
      // The cut has gone through a corner a little ahead of the instrument.
      return wait_here();
    }
    Vec3 bary_in = stroke_.bary;
    for (int i = 0; i < kMaxCellsPerStep; ++i) {
      const auto corners = corner_states(draft_, stroke_.cell.corners());
      const Exit exit = exit_of(corners, plane_);
      if (exit.edge < 0) return StrokeEnd::lost;
      const Vec3 bary_out = edge_bary(exit);
      const Vec3 in = VertexState::mix(corners, bary_in).position_world_m;
      const Vec3 out = VertexState::mix(corners, bary_out).position_world_m;
      const double progress_out = plane_.progress(out);
      if (progress_out >= 0) {
        const double progress_in = std::min(0.0, plane_.progress(in));
        const double s = progress_out > progress_in ? progress_in / (progress_in - progress_out) : 0.0;
        stroke_.bary = bary_in + s * (bary_out - bary_in);
        return join_if_close();
      }
      const StrokeEnd end = leave(exit, bary_in);
      if (end != StrokeEnd::going || waits_) return end;
    }
    return StrokeEnd::lost;
  }

 private:
  StrokeEnd refuse(std::string_view why) {
    stroke_.why_refused = why;
    return StrokeEnd::refused;
  }

  // The cut is a little ahead of the instrument and waits for it.
  StrokeEnd wait_here() {
    waits_ = true;
    return plane_.distance_m < 0.5 * settings_.join_tolerance_m ? ended_by_depth() : StrokeEnd::lost;
  }

  StrokeEnd ended_by_depth() {
    stroke_.depth_m = (position_of(draft_, stroke_) - blade_.tip_world_m).dot(blade_.up_world);
    return stroke_.depth_m < settings_.release_depth_m ? StrokeEnd::lifted : StrokeEnd::going;
  }

  // Makes the first point a vertex: an existing vertex when one is close, else a new one on an edge, else one inside
  // the face. At the end of an older cut the stroke continues that cut.
  bool begin() {
    const TriangleId touched = draft_.find_triangle(stroke_.touched[0], stroke_.touched[1], stroke_.touched[2]);
    const Triangle face{stroke_.touched, draft_.triangle(touched).surface};
    const VertexState state = state_at(draft_, stroke_);
    int nearest = 0, farthest = 0;
    stroke_.bary.maxCoeff(&nearest);
    stroke_.bary.minCoeff(&farthest);
    VertexId s = end_within_reach(face, state.position_world_m);
    if (s == kNone && stroke_.bary[nearest] > 1 - settings_.snap_ratio) s = face.v[static_cast<std::size_t>(nearest)];
    if (s == kNone && stroke_.bary[farthest] < settings_.inset) {
      const VertexId u = face.v[static_cast<std::size_t>((farthest + 1) % 3)];
      const VertexId w = face.v[static_cast<std::size_t>((farthest + 2) % 3)];
      const double b_u = stroke_.bary[(farthest + 1) % 3], b_w = stroke_.bary[(farthest + 2) % 3];
      s = insert_on_edge(draft_, u, w, VertexState::mix(draft_.state(u), draft_.state(w), b_w / (b_u + b_w)));
    }
    if (s == kNone) s = insert_in_face(draft_, touched, state);
    if (s == kNone) return false;
    if (const VertexId bottom = grooves_.end_at(s); bottom != kNone) {
      stroke_.bottom = bottom;
      grooves_.remove_end(s);
    } else {
      stroke_.start_bottom = bottom_under(draft_, face.v, draft_.state(s), blade_, settings_);
    }
    plane_ = SweepPlane(draft_.position(s), blade_);
    stroke_.first = s;
    stroke_.points = 1;
    return enter_at(s);
  }

  // The nearest end of a cut in this triangle or the triangles around it: the instrument may come down beside the end.
  VertexId end_within_reach(const Triangle& face, const Vec3& point) const {
    VertexId nearest = kNone;
    double least_m = settings_.join_tolerance_m;
    for (const VertexId corner : face.v)
      for (const TriangleId t : draft_.fan(corner))
        for (const VertexId v : draft_.triangle(t).v) {
          const double distance_m = (draft_.position(v) - point).norm();
          if (distance_m >= least_m || grooves_.end_at(v) == kNone) continue;
          least_m = distance_m;
          nearest = v;
        }
    return nearest;
  }

  bool enter_at(VertexId apex) {
    const std::optional<Cell> cell = cell_ahead(draft_, apex, stroke_.bottom, plane_);
    if (!cell) return false;
    stroke_.cell = *cell;
    stroke_.bary = Vec3::UnitX();
    return true;
  }

  // Leaves the cell. Over the rim, the cut becomes permanent up to there; over an edge of the apex, only the cell
  // changes.
  StrokeEnd leave(const Exit& exit, Vec3& bary_in) {
    const auto corners = stroke_.cell.corners();
    const VertexId u = corners[static_cast<std::size_t>(exit.edge)];
    const VertexId w = corners[static_cast<std::size_t>((exit.edge + 1) % 3)];
    const bool over_rim = stroke_.cell.rim.size() == 3 ? exit.edge != 2 : exit.edge == 1;
    return over_rim ? over(u, w, exit.t, bary_in) : turn(u, w, bary_in);
  }

  StrokeEnd over(VertexId u, VertexId w, double t, Vec3& bary_in) {
    const bool at_u = t<settings_.snap_ratio, at_w = t> 1 - settings_.snap_ratio;
    const std::array<VertexId, 3> corners = stroke_.cell.corners();
    VertexId next = at_u ? u : at_w ? w : kNone;
    Cell beyond;
    if (next == kNone) {
      const TriangleId across = draft_.triangle_of_edge(w, u);
      const Triangle t_across = draft_.triangle(across);
      const VertexId y = t_across.v[static_cast<std::size_t>((t_across.corner_of(u) + 1) % 3)];
      next = insert_on_edge(draft_, u, w, VertexState::mix(draft_.state(u), draft_.state(w), t));
      if (next == kNone) return refuse("an edge that the blade crosses can't be divided");
      if (grooves_.is_bottom(u) && grooves_.is_bottom(w)) grooves_.add_bottom(next);
      beyond = {next, {u, y, w}};
      bary_in = {1 - t, 0, t};
    }
    const StrokeEnd end = cut_to(next, corners);
    if (end != StrokeEnd::going) return end;
    if (!beyond.rim.empty()) {
      stroke_.cell = beyond;
      stroke_.bary = bary_in;
      return StrokeEnd::going;
    }
    bary_in = Vec3::UnitX();
    return enter_at(next) ? StrokeEnd::going : stand_at(next);
  }

  // The surface does not continue in this direction: the cut ends at a vertex of its own.
  StrokeEnd stand_at(VertexId apex) {
    stroke_.cell.apex = apex;
    stroke_.cell.rim.clear();
    return StrokeEnd::lost;
  }

  StrokeEnd turn(VertexId u, VertexId w, Vec3& bary_in) {
    const VertexId apex = stroke_.cell.apex;
    if (stroke_.cell.rim.size() == 3) (plane_.side(draft_.position(apex)) < 0 ? u : w) = apex;
    const TriangleId across = draft_.triangle_of_edge(w, u);
    if (across == kNone) return refuse("there is no surface beyond an edge");
    const Triangle next = draft_.triangle(across);
    if (stroke_.bottom != kNone && next.corner_of(stroke_.bottom) >= 0) return wait_here();  // back into the groove
    const Vec3 x_u = draft_.position(u), x_w = draft_.position(w);
    const double s_u = plane_.side(x_u), s_w = plane_.side(x_w);
    const double t = s_u < 0 && s_w >= 0 ? s_u / (s_u - s_w) : (u == apex ? 0.0 : 1.0);
    stroke_.cell = cell_of_triangle(next, apex);
    const auto corners = stroke_.cell.corners();
    bary_in = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      if (corners[static_cast<std::size_t>(i)] == u) bary_in[i] = 1 - t;
      if (corners[static_cast<std::size_t>(i)] == w) bary_in[i] = t;
    }
    stroke_.bary = bary_in;
    return StrokeEnd::going;
  }

  // Makes the cut permanent from the apex to `next`, along the edge between them.
  StrokeEnd cut_to(VertexId next, const std::array<VertexId, 3>& corners) {
    if (next == stroke_.start || next == stroke_.bottom) return refuse("the cut comes back to its last point");
    const VertexId bottom_there = grooves_.end_at(next);
    VertexState bottom = bottom_under(draft_, corners, draft_.state(next), blade_, settings_);
    if (bottom_there != kNone && stroke_.bottom != kNone)
      bottom = VertexState::mix(draft_.state(stroke_.bottom), draft_.state(bottom_there), 0.5);

    if (stroke_.bottom == kNone && stroke_.start == kNone) {
      stroke_.start = stroke_.cell.apex;
      stroke_.apex_bottom = bottom;
    } else if (stroke_.bottom == kNone) {
      const auto opening = open_start(draft_, stroke_.start, stroke_.cell.apex, next,
                                      {*stroke_.start_bottom, *stroke_.apex_bottom, bottom});
      if (!opening) return refuse("the faces where the cut begins can't be opened");
      part_lips(draft_, stroke_, opening->twin);
      grooves_.set_end(stroke_.start, opening->bottom[0]);
      for (const VertexId g : opening->bottom) grooves_.add_bottom(g);
      stroke_.bottom = opening->bottom[2];
      stroke_.start = kNone;
    } else {
      const auto extension = extend(draft_, stroke_.cell.apex, stroke_.bottom, next, bottom);
      if (!extension) return refuse("the faces ahead of the cut can't be opened");
      part_lips(draft_, stroke_, extension->twin);
      if (grooves_.is_bottom(stroke_.cell.apex)) grooves_.add_bottom(extension->twin);
      grooves_.add_bottom(extension->bottom);
      stroke_.bottom = extension->bottom;
    }
    stroke_.cell.apex = next;
    ++stroke_.points;
    return bottom_there != kNone && stroke_.bottom != kNone ? join(next, bottom_there) : StrokeEnd::going;
  }

  StrokeEnd join(VertexId v, VertexId bottom_there) {
    stroke_.joined_twin = join_grooves(draft_, v, stroke_.bottom, bottom_there);
    if (stroke_.joined_twin == kNone) return refuse("the two grooves can't be joined");
    grooves_.remove_end(v);
    stroke_.cell.rim.clear();
    return StrokeEnd::joined;
  }

  // Joins the cut in whose end triangle the instrument is (gray in figure 12), when its end is close enough.
  StrokeEnd join_if_close() {
    const StrokeEnd end = ended_by_depth();
    if (end != StrokeEnd::going || (stroke_.bottom == kNone && stroke_.start == kNone)) return end;
    const Vec3 here = position_of(draft_, stroke_);
    const std::vector<VertexId> rim = stroke_.cell.rim;
    for (const VertexId v : rim) {
      if (grooves_.end_at(v) == kNone || v == stroke_.start || (v == stroke_.first && stroke_.points < 4)) continue;
      if ((draft_.position(v) - here).norm() > settings_.join_tolerance_m) continue;
      return cut_to(v, stroke_.cell.corners());
    }
    return end;
  }

  MeshDraft& draft_;
  Stroke& stroke_;
  const Blade& blade_;
  GrooveDraft& grooves_;
  const StrokeSettings& settings_;
  SweepPlane plane_;
  bool waits_ = false;
};

// A point pulled into the triangle, so that the subdivision around it has no sliver.
Vec3 inset(const Vec3& bary, double least) {
  Vec3 b = bary.cwiseMax(least);
  return b / b.sum();
}

}  // namespace

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

SurfacePoint nearest_on(const MeshDraft& draft, std::span<const TriangleId> triangles, const Vec3& point_world_m) {
  SurfacePoint nearest;
  double least = 1e300;
  for (const TriangleId t : triangles) {
    const auto& v = draft.triangle(t).v;
    const ClosestPoint c =
        closest_on_triangle(point_world_m, {draft.position(v[0]), draft.position(v[1]), draft.position(v[2])});
    if (c.squared_distance >= least) continue;
    least = c.squared_distance;
    nearest = {t, c.bary};
  }
  return nearest;
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

StrokeEnd advance(MeshDraft& draft, Stroke& stroke, const Blade& blade, GrooveDraft& grooves,
                  const StrokeSettings& settings) {
  if (!settle(draft, stroke)) return StrokeEnd::lost;
  return Walk(draft, stroke, blade, grooves, settings).run();
}

bool open_temporarily(MeshDraft& draft, Stroke& stroke, const Blade& blade, const StrokeSettings& settings) {
  stroke.temporary_inverse.reset();
  stroke.temporary_tip = stroke.temporary_twin = kNone;
  stroke.temporary_bottoms.clear();
  if (stroke.cell.apex == kNone || stroke.cell.rim.empty()) return true;

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
    stroke.temporary_bottoms.assign(opening->bottom.begin(), opening->bottom.end());
  }
  if (stroke.temporary_twin != kNone) part_lips(draft, stroke, stroke.temporary_twin);
  stroke.lips.reset();
  stroke.temporary_tip = q;
  stroke.temporary_inverse = draft.inverse_since_mark();
  return true;
}

}  // namespace sectio
