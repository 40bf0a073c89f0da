#include "sim_server/surface/cutting/stroke_walk.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sectio {
namespace {

constexpr int kMaxCellsPerStep = 100000;
constexpr double kSamePlace_m = 1e-7;
constexpr double kThere_m = 1e-9;         // short of a target on a rim, behind which the surface falls away
constexpr double kCosFold = 0.9;          // between the normals of faces that lie back to back
constexpr std::size_t kPointsBehind = 6;  // a cut can't run into so many of its own last points

// The normal along which a way is seen. On a way over a rim, either face alone would hide the part on the other.
Vec3 across_rims(const Vec3& normal, const WalkTarget& target) {
  const double cosine = normal.dot(target.normal_body);
  if (target.normal_body.isZero() || cosine > kCosRim || cosine < -kCosFold) return normal;
  return (normal + target.normal_body).normalized();
}

// The plane through two places and along the normal of the surface, all at rest, and progress in that plane.
struct WalkPlane {
  Vec3 origin, ahead, left, to;
  double distance_m = 0;

  WalkPlane(const Vec3& from, const WalkTarget& target, const Vec3& normal)
      : WalkPlane(from, target.rest_body_m, across_rims(normal, target)) {}
  WalkPlane(const Vec3& from, const Vec3& target, const Vec3& normal) : origin(from), to(target) {
    const Vec3 way = to - from;
    ahead = way - way.dot(normal) * normal;
    distance_m = ahead.norm();
    if (distance_m > 0) ahead /= distance_m;
    left = normal.cross(ahead);
  }
  double side(const Vec3& x) const { return left.dot(x - origin); }   // > 0: to the left
  double progress(const Vec3& x) const { return ahead.dot(x - to); }  // >= 0: the target is not further
};

using Places = std::array<Vec3, 3>;
Places rest_of(const MeshDraft& draft, const std::array<VertexId, 3>& corners) {
  return {draft.rest(corners[0]), draft.rest(corners[1]), draft.rest(corners[2])};
}
Vec3 at(const Places& c, const Vec3& bary) {
  return bary[0] * c[0] + bary[1] * c[1] + bary[2] * c[2];
}

// The exit of the plane from a triangle that it entered: the one edge that it crosses from right to left.
struct Exit {
  int edge = -1;
  double t = 0;  // along the edge
};

Exit exit_of(const Places& corners, const WalkPlane& plane) {
  std::array<double, 3> s;
  for (std::size_t i = 0; i < 3; ++i) s[i] = plane.side(corners[i]);
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

// The skin of the fan of `apex` into which the plane leads.
std::optional<Cell> cell_ahead(const MeshDraft& draft, VertexId apex, const WalkPlane& plane) {
  std::optional<Cell> best;
  double best_progress = plane.progress(draft.rest(apex)) - 1e-12;
  for (const TriangleId t : draft.fan(apex)) {
    const Triangle triangle = draft.triangle(t);
    if (triangle.surface != Surface::skin) continue;
    const Cell cell = cell_of_triangle(triangle, apex);
    const Vec3 u = draft.rest(cell.rim[0]), w = draft.rest(cell.rim[1]);
    const double s_u = plane.side(u), s_w = plane.side(w);
    if (!(s_u < 0 && s_w >= 0)) continue;
    const double progress = plane.progress(u + s_u / (s_u - s_w) * (w - u));
    if (progress <= best_progress) continue;
    best = cell;
    best_progress = progress;
  }
  return best;
}

Vec3 normal_around(const MeshDraft& draft, VertexId v) {
  Vec3 sum = Vec3::Zero();
  for (const TriangleId t : draft.fan(v))
    if (const Triangle triangle = draft.triangle(t); triangle.surface == Surface::skin)
      sum += rest_normal_of(draft, triangle.v);
  return sum.stableNormalized();
}

Vec3 normal_at_end(const MeshDraft& draft, const Stroke& stroke) {
  if (stroke.cuts() && (stroke.cell.rim.empty() || stroke.bary[0] == 1)) return normal_around(draft, stroke.cell.apex);
  return rest_normal_of(draft, stroke);
}

class Walk {
 public:
  Walk(MeshDraft& draft, Stroke& stroke, const Blade& blade, Grooves& grooves, const StrokeSettings& settings,
       const WalkTarget& target)
      : draft_(draft),
        stroke_(stroke),
        blade_(blade),
        grooves_(grooves),
        settings_(settings),
        target_(target),
        plane_(sectio::rest_of(draft, stroke), target, normal_at_end(draft, stroke)) {}

  WalkEnd run() {
    if (!stroke_.cuts() && !begin()) return refuse("the surface can't be divided where the cut begins");
    if (plane_.distance_m < 1e-9) return WalkEnd::there;
    const bool is_at_apex = stroke_.cell.rim.empty() || (stroke_.cell.rim.size() == 2 && stroke_.bary[0] == 1);
    if (is_at_apex && !enter_at(stroke_.cell.apex)) return WalkEnd::waits;
    Vec3 bary_in = stroke_.bary;
    double way_m = 0;
    const double most_m =
        settings_.longest_way_ratio * (target_.rest_body_m - sectio::rest_of(draft_, stroke_)).norm() +
        settings_.longest_detour_m;
    for (int i = 0; i < kMaxCellsPerStep; ++i) {
      const auto corners = stroke_.cell.corners();
      if (target_.vertex != kNone && std::ranges::find(stroke_.cell.rim, target_.vertex) != stroke_.cell.rim.end())
        return cut_to(target_.vertex, corners).value_or(WalkEnd::there);
      const Places places = rest_of(draft_, corners);
      const Exit exit = exit_of(places, plane_);
      if (exit.edge < 0) return WalkEnd::waits;
      const Vec3 bary_out = edge_bary(exit);
      const double progress_out = plane_.progress(at(places, bary_out));
      if (progress_out >= -kThere_m) {
        const double progress_in = std::min(0.0, plane_.progress(at(places, bary_in)));
        const double s = progress_out > progress_in ? std::min(1.0, progress_in / (progress_in - progress_out)) : 0.0;
        stroke_.bary = bary_in + s * (bary_out - bary_in);
        return WalkEnd::there;
      }
      way_m += (at(places, bary_out) - at(places, bary_in)).norm();
      if (way_m > most_m) return WalkEnd::waits;
      if (const auto end = leave(exit, bary_in)) return *end;
    }
    return WalkEnd::waits;
  }

 private:
  using MayEnd = std::optional<WalkEnd>;  // nothing: the walk goes on

  WalkEnd refuse(std::string_view why) {
    stroke_.why_refused = why;
    return WalkEnd::refused;
  }

  bool is_behind(VertexId v) const {
    const Vec3 place = draft_.rest(v);
    return std::ranges::any_of(stroke_.behind_body_m, [&](const Vec3& x) { return (x - place).norm() < kSamePlace_m; });
  }
  bool is_lip(VertexId u, VertexId v) const {
    const auto is_wall = [&](TriangleId t) { return t != kNone && draft_.triangle(t).surface == Surface::wall; };
    return is_wall(draft_.triangle_of_edge(u, v)) || is_wall(draft_.triangle_of_edge(v, u));
  }
  bool is_on_lip(VertexId v) const { return grooves_.bottom_of(v) != kNone; }

  // Makes the first point a vertex: an existing vertex when one is close, else a new one on an edge, else one inside
  // the face; never on a lip.
  bool begin() {
    const TriangleId touched = draft_.find_triangle(stroke_.touched[0], stroke_.touched[1], stroke_.touched[2]);
    const Triangle face{stroke_.touched, draft_.triangle(touched).surface};
    const VertexState state =
        VertexState::mix({draft_.state(face.v[0]), draft_.state(face.v[1]), draft_.state(face.v[2])}, stroke_.bary);
    int nearest = 0, farthest = 0;
    stroke_.bary.maxCoeff(&nearest);
    stroke_.bary.minCoeff(&farthest);
    VertexId s = kNone;
    if (stroke_.bary[nearest] > 1 - settings_.snap_ratio) s = face.v[static_cast<std::size_t>(nearest)];
    if (s != kNone && is_on_lip(s)) s = kNone;
    const VertexId u = face.v[static_cast<std::size_t>((farthest + 1) % 3)];
    const VertexId w = face.v[static_cast<std::size_t>((farthest + 2) % 3)];
    if (s == kNone && stroke_.bary[farthest] < settings_.inset && !(is_on_lip(u) && is_on_lip(w))) {
      const double b_u = stroke_.bary[(farthest + 1) % 3], b_w = stroke_.bary[(farthest + 2) % 3];
      s = insert_on_edge(draft_, u, w, VertexState::mix(draft_.state(u), draft_.state(w), b_w / (b_u + b_w)));
    }
    if (s == kNone) s = insert_in_face(draft_, touched, state);
    if (s == kNone) return false;
    stroke_.start_bottom = bottom_under(draft_, face.v, draft_.state(s), blade_, settings_);
    stroke_.first = s;
    stroke_.temporary_cell = {};
    stroke_.points = 1;
    stroke_.length_m = 0;
    stroke_.heading_body.setZero();
    stroke_.behind_body_m = {draft_.rest(s)};
    plane_ = WalkPlane(draft_.rest(s), target_, normal_around(draft_, s));
    stand_at(s);
    return enter_at(s);
  }

  bool enter_at(VertexId apex) {
    const std::optional<Cell> cell = cell_ahead(draft_, apex, plane_);
    if (!cell) return false;
    stroke_.cell = *cell;
    stroke_.bary = Vec3::UnitX();
    return true;
  }

  void stand_at(VertexId apex) {
    stroke_.cell.apex = apex;
    stroke_.cell.rim.clear();
  }

  // Leaves the cell. Over the rim, the cut becomes permanent up to there; over an edge of the apex, only the cell
  // changes.
  MayEnd leave(const Exit& exit, Vec3& bary_in) {
    const auto corners = stroke_.cell.corners();
    const VertexId u = corners[static_cast<std::size_t>(exit.edge)];
    const VertexId w = corners[static_cast<std::size_t>((exit.edge + 1) % 3)];
    const bool over_rim = stroke_.cell.rim.size() == 3 ? exit.edge != 2 : exit.edge == 1;
    return over_rim ? over(u, w, exit.t, bary_in) : turn(u, w, bary_in);
  }

  MayEnd over(VertexId u, VertexId w, double t, Vec3& bary_in) {
    const TriangleId across = draft_.triangle_of_edge(w, u);
    if (across == kNone) return refuse("there is no surface beyond an edge");
    const std::array<VertexId, 3> corners = stroke_.cell.corners();
    const Triangle beyond_edge = draft_.triangle(across);
    if (beyond_edge.surface == Surface::wall) return meet({u, w}, t, corners);
    VertexId next = t < settings_.snap_ratio ? u : t > 1 - settings_.snap_ratio ? w : kNone;
    if (next != kNone && (is_behind(next) || is_lip(stroke_.cell.apex, next))) next = kNone;
    Cell beyond;
    if (next == kNone) {
      t = std::clamp(t, settings_.inset, 1 - settings_.inset);
      const VertexId y = beyond_edge.after(u);
      next = insert_on_edge(draft_, u, w, VertexState::mix(draft_.state(u), draft_.state(w), t));
      if (next == kNone) return refuse("an edge that the blade crosses can't be divided");
      beyond = {next, {u, y, w}};
      bary_in = {1 - t, 0, t};
    }
    if (const MayEnd end = cut_to(next, corners)) return end;
    if (!beyond.rim.empty()) {
      stroke_.cell = beyond;
      stroke_.bary = bary_in;
      return std::nullopt;
    }
    bary_in = Vec3::UnitX();
    if (enter_at(next)) return std::nullopt;
    stand_at(next);
    return WalkEnd::waits;
  }

  // The skin ends at the lip of another groove, or of its own: the cuts meet in a rung.
  MayEnd meet(const Lip& lip, double t, const std::array<VertexId, 3>& corners) {
    const double length_m = (draft_.rest(lip.to) - draft_.rest(lip.from)).norm();
    const auto is_near = [&](VertexId v, double along) {
      const bool is_node = twins_of(draft_, grooves_, v).size() > 2;
      return along < settings_.rung_ratio || (is_node && along * length_m < settings_.node_m);
    };
    VertexId rung = rung_at(draft_, grooves_, lip, t, is_near);
    if (is_behind(rung)) rung = rung == lip.from ? lip.to : lip.from;
    if (is_behind(rung)) return WalkEnd::waits;
    if (!is_on_lip(rung)) return refuse("the cut comes to a groove that can't be joined");
    const MayEnd end = cut_to(rung, corners);
    if (end) return end;
    return WalkEnd::waits;
  }

  // The straight way to the target leads back into the groove, round the apex; the cut goes there from the apex.
  MayEnd go_from_apex(Vec3& bary_in) {
    const VertexId apex = stroke_.cell.apex;
    if (std::exchange(goes_from_apex_, true)) return WalkEnd::waits;
    plane_ = WalkPlane(draft_.rest(apex), target_, normal_around(draft_, apex));
    bary_in = Vec3::UnitX();
    if (enter_at(apex)) return std::nullopt;
    return WalkEnd::waits;
  }

  MayEnd turn(VertexId u, VertexId w, Vec3& bary_in) {
    const VertexId apex = stroke_.cell.apex;
    if (stroke_.cell.rim.size() == 3) (plane_.side(draft_.rest(apex)) < 0 ? u : w) = apex;
    const TriangleId across = draft_.triangle_of_edge(w, u);
    if (across == kNone) return refuse("there is no surface beyond an edge");
    const Triangle next = draft_.triangle(across);
    if (next.surface == Surface::wall) return go_from_apex(bary_in);
    const Vec3 x_u = draft_.rest(u), x_w = draft_.rest(w);
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
    return std::nullopt;
  }

  // Makes the cut permanent from the apex to `next`, along the edge between them.
  MayEnd cut_to(VertexId next, const std::array<VertexId, 3>& corners) {
    if (next == stroke_.start || is_lip(stroke_.cell.apex, next)) return WalkEnd::waits;
    const VertexId bottom_there = grooves_.bottom_of(next);
    VertexState bottom = drift_of_last_bottom(draft_, stroke_, blade_)
                             .from(bottom_under(draft_, corners, draft_.state(next), blade_, settings_));
    if (bottom_there != kNone && stroke_.bottom != kNone)
      bottom = VertexState::mix(draft_.state(stroke_.bottom), draft_.state(bottom_there), 0.5);
    const VertexId from = stroke_.cell.apex;
    const Vec3 way = draft_.rest(next) - draft_.rest(from);

    if (stroke_.bottom == kNone && stroke_.start == kNone && bottom_there != kNone && !score_half_way(next, bottom))
      return refuse("the faces where the cut begins can't be opened");
    if (stroke_.bottom == kNone && stroke_.start == kNone) {
      stroke_.start = from;
      stroke_.apex_bottom = bottom;
    } else if (stroke_.bottom == kNone) {
      if (!open(next, bottom)) return refuse("the faces where the cut begins can't be opened");
    } else {
      if (!go_on(next, bottom)) return refuse("the faces ahead of the cut can't be opened");
    }
    stroke_.cell.apex = next;
    ++stroke_.points;
    stroke_.length_m += way.norm();
    stroke_.heading_body = heading_over_last_points(draft_.rest(next));
    stroke_.behind_body_m.push_back(draft_.rest(next));
    if (stroke_.behind_body_m.size() > kPointsBehind) stroke_.behind_body_m.erase(stroke_.behind_body_m.begin());
    return bottom_there != kNone ? join(next, bottom_there) : MayEnd{};
  }

  // A single point may have snapped aside, or a little back.
  Vec3 heading_over_last_points(const Vec3& end_body_m) const {
    Vec3 way = Vec3::Zero();
    for (std::size_t i = stroke_.behind_body_m.size(); i-- > 0 && way.norm() < kHeading_m;)
      way = end_body_m - stroke_.behind_body_m[i];
    return way.stableNormalized();
  }

  // An opening needs a point between its ends.
  bool score_half_way(VertexId next, const VertexState& bottom) {
    const VertexId from = stroke_.cell.apex;
    const VertexId middle =
        insert_on_edge(draft_, from, next, VertexState::mix(draft_.state(from), draft_.state(next), 0.5));
    if (middle == kNone) return false;
    stroke_.start = from;
    stroke_.cell.apex = middle;
    stroke_.apex_bottom = VertexState::mix(*stroke_.start_bottom, bottom, 0.5);
    return true;
  }

  bool open(VertexId next, const VertexState& bottom) {
    const auto opening = open_start(draft_, stroke_.start, stroke_.cell.apex, next,
                                    {*stroke_.start_bottom, *stroke_.apex_bottom, bottom});
    if (!opening) return false;
    part_lips(draft_, stroke_, opening->twin);
    grooves_.ends[stroke_.start] = opening->bottom[0];
    grooves_.set_bottom(stroke_.start, opening->bottom[0]);
    grooves_.set_bottom(stroke_.cell.apex, opening->bottom[1]);
    grooves_.set_bottom(opening->twin, opening->bottom[1]);
    grooves_.set_bottom(next, opening->bottom[2]);
    stroke_.bottom = opening->bottom[2];
    stroke_.start = kNone;
    return true;
  }

  bool go_on(VertexId next, const VertexState& bottom) {
    const auto extension = extend(draft_, stroke_.cell.apex, stroke_.bottom, next, bottom);
    if (!extension) return false;
    part_lips(draft_, stroke_, extension->twin);
    grooves_.set_bottom(extension->twin, stroke_.bottom);
    grooves_.set_bottom(next, extension->bottom);
    stroke_.bottom = extension->bottom;
    return true;
  }

  WalkEnd join(VertexId v, VertexId bottom_there) {
    const VertexId twin = join_grooves(draft_, v, stroke_.bottom, bottom_there);
    if (twin == kNone) return refuse("the two grooves can't be joined");
    grooves_.set_bottom(v, bottom_there);
    grooves_.set_bottom(twin, bottom_there);
    grooves_.ends.erase(v);
    stroke_.met.push_back({v, twin});
    stroke_.seen.on_lid_body_m = draft_.rest(v);
    stand_beside(draft_, stroke_, v);
    return WalkEnd::joined;
  }

  MeshDraft& draft_;
  Stroke& stroke_;
  const Blade& blade_;
  Grooves& grooves_;
  const StrokeSettings& settings_;
  const WalkTarget& target_;
  WalkPlane plane_;
  bool goes_from_apex_ = false;
};

}  // namespace

WalkEnd walk(MeshDraft& draft, Stroke& stroke, const Blade& blade, Grooves& grooves, const StrokeSettings& settings,
             const WalkTarget& target) {
  return Walk(draft, stroke, blade, grooves, settings, target).run();
}

bool branch_off(const MeshDraft& draft, Stroke& stroke, const Grooves& grooves, VertexId lip, const Vec3& to_body_m) {
  const WalkPlane plane(draft.rest(lip), to_body_m, normal_around(draft, lip));
  // Not only its twins: an island has lips of its own at the same places.
  const Vec3 place = draft.rest(lip);
  for (const auto& [v, bottom] : grooves.rungs) {
    if (draft.rest(v) != place) continue;
    const auto cell = cell_ahead(draft, v, plane);
    if (!cell) continue;
    stroke.cell = *cell;
    stroke.bary = Vec3::UnitX();
    stroke.branches_from(place, bottom);
    return true;
  }
  return false;
}

void stand_beside(const MeshDraft& draft, Stroke& stroke, VertexId v) {
  stroke.cell = {};
  stroke.bottom = stroke.start = stroke.first = kNone;
  stroke.heading_body.setZero();
  stroke.lips.reset();
  for (const TriangleId t : draft.fan(v))
    if (const Triangle triangle = draft.triangle(t); triangle.surface == Surface::skin) {
      stroke.touched = triangle.v;
      stroke.bary = Vec3::Unit(triangle.corner_of(v));
      return;
    }
}

bool settle(const MeshDraft& draft, Stroke& stroke, const Grooves* grooves) {
  const VertexId apex = stroke.cell.apex;
  if (apex == kNone) return draft.find_triangle(stroke.touched[0], stroke.touched[1], stroke.touched[2]) != kNone;
  if (draft.incident(apex) == kNone) return false;
  if (stroke.cell.rim.empty() || !triangles_of(draft, stroke.cell).empty()) return true;
  std::vector<TriangleId> around;
  for (const VertexId twin : grooves ? twins_of(draft, *grooves, apex) : std::vector<VertexId>{apex})
    std::ranges::copy(draft.fan(twin), std::back_inserter(around));
  std::erase_if(around, [&](TriangleId t) { return draft.triangle(t).surface != Surface::skin; });
  const SurfacePoint end = nearest_on(draft, around, position_of(draft, stroke));
  if (end.triangle == kNone) return false;
  const Triangle triangle = draft.triangle(end.triangle);
  const Vec3 place = draft.rest(apex);
  const VertexId from = *std::ranges::find(triangle.v, place, [&](VertexId v) { return draft.rest(v); });
  if (from != apex) stroke.branches_from(place, grooves->bottom_of(from));
  stroke.cell = cell_of_triangle(triangle, from);
  const int first = triangle.corner_of(from);
  stroke.bary = {end.bary[first], end.bary[(first + 1) % 3], end.bary[(first + 2) % 3]};
  return true;
}

}  // namespace sectio
