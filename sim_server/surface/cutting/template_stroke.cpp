#include "sim_server/surface/cutting/template_stroke.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"

namespace sectio {

namespace {

constexpr double kDeeper_m = 1e-5;    // a deepened groove is clear of the trail by this
constexpr double kOutBelow_m = 1e-3;  // a tip that is out on the other side is this far out, at least
constexpr double kBackwards = -0.2;   // cosine to a front: a blade that has drawn back further does not cut
constexpr double kOnward = 0.25;      // a blade that rises still cuts when it goes on by this share of its rise
constexpr double kHeading_m = 1e-3;   // a cut's direction is taken over this way: a short step may go anywhere
constexpr double kGrooveAhead = 4;    // tolerances from a blade in a groove to the end of the groove
constexpr double kMostSlant = 2;      // slant of a joined front, in tolerances between its ends along the motion
constexpr int kMostSteps = 64;        // steps into which one motion is divided
constexpr double kSamePart_m = 1e-3;  // vertices of a temporary part that is made anew are this near to the last ones

// Does all of a triangle run along the plane, in the groove that the blade is in?
bool lies_along(const MeshDraft& draft, const BladeSweep& sweep, const Triangle& t, double within_m) {
  return std::all_of(t.v.begin(), t.v.end(),
                     [&](VertexId v) { return std::abs(sweep.side(draft.rest(v))) <= within_m; });
}

}  // namespace

std::size_t deepen_groove(MeshDraft& draft, const RestBlade& first, const RestBlade& last, const Grooves& grooves,
                          std::span<const TriangleId> active, const TemplateSettings& settings) {
  const BladeSweep sweep = sweep_between(draft, first, last, {});
  if (!(sweep.length_m() > 0)) return 0;
  std::vector<TriangleId> open(active.begin(), active.end());
  std::set<TriangleId> seen(open.begin(), open.end());
  std::set<VertexId> moved;
  for (std::size_t k = 0; k < open.size(); ++k) {
    const Triangle t = draft.triangle(open[k]);
    const auto is_bottom = [&](VertexId v) { return grooves.bottoms.contains(v); };
    if (!t.alive() || t.surface != Surface::wall || !std::all_of(t.v.begin(), t.v.end(), is_bottom)) continue;
    if (!lies_along(draft, sweep, t, settings.open_top_m)) continue;
    for (const VertexId v : t.v) {
      const Vec3 x = draft.rest(v);
      const Vec2 at = sweep.in_plane(x);
      if (at.x() < sweep.tip_first().x() || at.x() > sweep.tip_last().x()) continue;
      const double down_m = at.y() - sweep.trail_height(at.x());
      if (down_m <= 0 || !moved.insert(v).second) continue;
      const Mat3 to_world = world_from_rest(draft, t.v);
      const VertexState s = draft.state(v);
      const Vec3 down = -(down_m + kDeeper_m) * sweep.up;
      draft.move_vertex(v, {s.rest_body_m + down, s.position_world_m + to_world * down, s.velocity_world_m_per_s});
    }
    for (int i = 0; i < 3; ++i)
      if (const TriangleId next = draft.neighbour(open[k], i); seen.insert(next).second) open.push_back(next);
  }
  return moved.size();
}

namespace {

void take_to(MeshDraft& draft, TargetStates& targets) {
  for (const auto& [v, state] : targets)
    if (draft.incident(v) != kNone) {
      VertexState s = state;
      s.velocity_world_m_per_s = draft.state(v).velocity_world_m_per_s;
      draft.move_vertex(v, s);
    }
  targets.clear();
}

// The upper end of the edge in the body at the end of a sweep: its path, and the last of the path's points that is not
// inside a face.
struct LastCrossing {
  bool blade_is_in = false;
  bool opens = false;  // a point behind it becomes a pair
  double at_m = 0;     // distance ahead
};
LastCrossing last_crossing(const std::vector<SurfacePath>& paths, double min_step_m) {
  const SurfacePath* top = nullptr;
  for (const SurfacePath& p : paths)
    if (!p.closed && p.points.back().rim == SweepRim::last_pose &&
        (!top || p.points.back().rim_position > top->points.back().rim_position))
      top = &p;
  if (!top) return {};
  LastCrossing c;
  c.blade_is_in = true;
  std::size_t k = top->points.size() - 1;
  while (k > 0 && top->points[k].kind == PathPoint::Kind::in_face) --k;
  c.at_m = top->points[k].at.x();
  for (std::size_t i = top->points.front().ridge != kNone ? 0 : 1; i < k; ++i)
    c.opens |= top->points[i].at.x() <= c.at_m - min_step_m;
  return c;
}

// The middle of the first hole that a path goes round; a cut up to there opens the hole.
std::optional<double> middle_of_hole(const std::vector<SurfacePath>& paths) {
  std::optional<double> first;
  for (const SurfacePath& path : paths) {
    if (!goes_round_a_hole(path)) continue;
    const auto [least, most] = std::minmax_element(path.points.begin(), path.points.end(),
                                                   [](const auto& a, const auto& b) { return a.at.x() < b.at.x(); });
    const double middle = 0.5 * (least->at.x() + most->at.x());
    if (!first || middle < *first) first = middle;
  }
  return first;
}

RestBlade blade_at(const BladeSweep& sweep, double ahead_m, const RestBlade& blade) {
  RestBlade at = blade;
  at.tip_body_m = sweep.origin + ahead_m * sweep.ahead + sweep.trail_height(ahead_m) * sweep.up;
  return at;
}

bool is_own(const TemplateStroke& stroke, const CutFront& f) {
  return std::any_of(stroke.fronts.begin(), stroke.fronts.end(), [&](const CutFront& o) { return o.top == f.top; });
}

// The first front that the sweep reaches, of another groove or of the stroke's own beginning.
std::optional<CutFront> groove_ahead(const MeshDraft& draft, const TemplateStroke& stroke, const BladeSweep& sweep,
                                     const Grooves& grooves, const TemplateSettings& settings) {
  std::optional<CutFront> nearest;
  const double tolerance_m = settings.join_tolerance_m, from_m = sweep.tip_first().x() + settings.min_step_m;
  double nearest_m = sweep.tip_last().x() + tolerance_m;
  for (const CutFront& f : grooves.fronts) {
    if (is_own(stroke, f) || !still_there(draft, f)) continue;
    const Vec3 top = draft.rest(f.top), bottom = draft.rest(f.bottom);
    const double ahead_m = sweep.in_plane(top).x(), bottom_ahead_m = sweep.in_plane(bottom).x();
    const auto [near_m, far_m] = std::minmax(ahead_m, bottom_ahead_m);
    if (near_m < from_m || near_m > nearest_m || far_m > near_m + kMostSlant * tolerance_m) continue;
    if (std::max(std::abs(sweep.side(top)), std::abs(sweep.side(bottom))) > tolerance_m) continue;
    if (sweep.in_plane(top).y() < sweep.trail_height(ahead_m) || f.ahead_body.dot(sweep.ahead) >= 0) continue;
    nearest = f;
    nearest_m = near_m;
  }
  return nearest;
}

// The line of a front as a pose. If its bottom is on the surface, the tip is outside the body.
RestBlade along(const MeshDraft& draft, const CutFront& f) {
  RestBlade blade;
  const Vec3 bottom = draft.rest(f.bottom);
  blade.up_body = (draft.rest(f.top) - bottom).stableNormalized();
  blade.tip_body_m = f.bottom_on_surface ? Vec3(bottom - kOutBelow_m * blade.up_body) : bottom;
  return blade;
}

// The end of a groove that a stroke goes on from.
struct GrooveEnd {
  const CutFront* front = nullptr;
  bool is_reached = true;
};

// The end at which a blade has been put down: it presses the skin ahead before it breaks in, and may be in the groove.
GrooveEnd end_put_down_at(const MeshDraft& draft, const TemplateStroke& stroke, const RestBlade& blade,
                          const Grooves& grooves, double within_m) {
  GrooveEnd nearest;
  if (!stroke.entered_body_m) return nearest;
  for (const CutFront& f : grooves.fronts) {
    if (!still_there(draft, f)) continue;
    const double from_m = distance_to_segment(*stroke.entered_body_m, draft.rest(f.top), draft.rest(f.bottom));
    if (from_m >= within_m) continue;
    nearest.front = &f;
    within_m = from_m;
  }
  if (const CutFront* f = nearest.front)
    nearest.is_reached = sweep_between(draft, along(draft, *f), blade, {f, 1}).ahead.dot(f->ahead_body) > 0;
  return nearest;
}

// The end on the way of a blade that was put down behind it, or beside it. The way of a blade in a groove leads on to
// the end of the groove.
GrooveEnd end_on_way(const MeshDraft& draft, const TemplateStroke& stroke, const BladeSweep& sweep,
                     const RestBlade& blade, const Grooves& grooves, const TemplateSettings& settings) {
  double within_m = settings.join_tolerance_m;
  const double way_m = sweep.length_m() + (stroke.begins_at_wall ? kGrooveAhead * settings.join_tolerance_m : 0);
  GrooveEnd nearest;
  for (const CutFront& f : grooves.fronts) {
    if (!still_there(draft, f)) continue;
    double distance_m = 0, from_blade_m = 0, most_ahead_m = 0;
    for (const VertexId v : {f.top, f.bottom}) {
      const Vec3 x = draft.rest(v);
      const double ahead_m = sweep.in_plane(x).x() - sweep.tip_first().x();
      const bool is_on_way = ahead_m >= 0 && ahead_m <= way_m;
      distance_m = std::max(distance_m, std::hypot(sweep.side(x), is_on_way ? 0 : ahead_m));
      const Vec3 from_tip = x - blade.tip_body_m;
      from_blade_m = std::max(from_blade_m, (from_tip - from_tip.dot(blade.up_body) * blade.up_body).norm());
      most_ahead_m = std::max(most_ahead_m, ahead_m);
    }
    distance_m = std::min(distance_m, from_blade_m);  // slanting, it may have been put down beside the end
    if (distance_m >= within_m || f.ahead_body.dot(sweep.ahead) <= 0) continue;
    nearest = {&f, most_ahead_m <= sweep.length_m() - settings.min_step_m};
    within_m = distance_m;
  }
  return nearest;
}

// Lets a stroke that begins at the end of a groove go on with that groove. False while the blade has yet to come to
// that end; lips that it brushes on the way are not cut.
bool take_up_groove(const MeshDraft& draft, TemplateStroke& stroke, const RestBlade& blade, const Grooves& grooves,
                    const TemplateSettings& settings) {
  const BladeSweep sweep = sweep_between(draft, *stroke.at_front, blade, {});
  GrooveEnd end;
  if (sweep.length_m() < settings.join_tolerance_m)
    end = end_put_down_at(draft, stroke, blade, grooves, settings.join_tolerance_m);
  if (!end.front && sweep.length_m() >= settings.min_step_m)
    end = end_on_way(draft, stroke, sweep, blade, grooves, settings);
  // In a groove, the first bit of a way doesn't tell yet whether it leads to the end, or through a wall.
  if (!end.front) return !stroke.begins_at_wall || sweep.length_m() >= settings.join_tolerance_m;
  if (!end.is_reached) return false;
  stroke.fronts = {*end.front};
  stroke.at_front = along(draft, *end.front);
  return true;
}

void replace_fronts(const TemplateStroke& stroke, std::span<const CutFront> fronts, std::span<const CutFront> starts,
                    Grooves& grooves) {
  for (const CutFront& f : stroke.fronts) grooves.remove_front(f);
  for (const auto& list : {fronts, starts})
    for (const CutFront& f : list) grooves.add_front(f);
}

// The vertices that the undo of a temporary part takes away.
std::vector<VertexId> vertices_taken_by(const TopologyDelta& inverse) {
  std::vector<VertexId> taken;
  for (const VertexEdit& e : inverse.vertices)
    if (!e.alive) taken.push_back(e.id);
  return taken;
}

}  // namespace

void take_bottoms_to_tip(MeshDraft& draft, TemplateStroke& stroke) {
  take_to(draft, stroke.bottoms_at_tip);
  for (CutFront& f : stroke.fronts) f.bottom_at_tip.reset();
}

bool undo_temporary(MeshDraft& draft, TemplateStroke& stroke) {
  if (!stroke.temporary_inverse) return true;
  stroke.last_temporary.clear();
  for (const VertexId v : vertices_taken_by(*stroke.temporary_inverse))
    stroke.last_temporary.emplace_back(v, draft.state(v));
  const bool undone = draft.undo(*stroke.temporary_inverse);
  for (const auto& [v, by_world] : stroke.temporarily_moved) {
    if (!undone) break;
    VertexState state = draft.state(v);
    state.position_world_m -= by_world;
    draft.move_vertex(v, state);
  }
  stroke.temporarily_moved.clear();
  stroke.temporary_fronts.clear();
  stroke.temporary_starts.clear();
  stroke.temporary_inverse.reset();
  stroke.temporary_bottoms_at_tip.clear();
  stroke.temporary_bottoms.clear();
  return undone;
}

namespace {

// The hand trembles about its way: a cut goes on once the blade is ahead of its front, or far enough to turn.
bool goes_on(const TemplateStroke& stroke, const BladeSweep& sweep, const TemplateSettings& settings) {
  const double way_m = sweep.length_m();
  if (!(way_m >= settings.min_step_m)) return false;
  if (stroke.fronts.empty() || way_m >= kHeading_m) return true;
  return way_m * stroke.fronts.front().ahead_body.dot(sweep.ahead) >= settings.min_step_m;
}

SweepEnds ends_of(const TemplateStroke& stroke) {
  SweepEnds ends{stroke.fronts};
  if (stroke.frame_world) ends.world_from_rest = stroke.frame_world->orientation.toRotationMatrix();
  return ends;
}

enum class Went : std::uint8_t { on, nowhere, left_body, joined, refused };

// Makes one permanent step towards the blade, if there is one to make.
Went go_on(MeshDraft& draft, TemplateStroke& stroke, const RestBlade& blade, Grooves& grooves,
           const TemplateSettings& settings) {
  SweepEnds ends = ends_of(stroke);
  BladeSweep sweep = sweep_between(draft, *stroke.at_front, blade, ends.fronts);
  if (!goes_on(stroke, sweep, settings)) return Went::nowhere;
  const auto refuse = [&](std::string_view why) {
    stroke.why_refused = why;
    return Went::refused;
  };
  if (!stroke.fronts.empty() && stroke.fronts.front().ahead_body.dot(sweep.ahead) < kBackwards)
    return refuse("the blade goes back from where its cut has come to");
  RestBlade last = blade;
  ends.target = groove_ahead(draft, stroke, sweep, grooves, settings);
  if (ends.target) {
    last = along(draft, *ends.target);
    sweep = sweep_between(draft, *stroke.at_front, last, ends.fronts);
  }
  std::optional<std::vector<SurfacePath>> paths;
  for (const PathSnap& snap : snaps_to_try(settings)) {
    paths = sweep_paths(draft, sweep, ends, stroke.active, snap, settings.inset);
    if (paths) break;
  }
  if (!paths) return refuse(kNoPath);
  if (paths->empty()) return Went::nowhere;
  const LastCrossing crossing = last_crossing(*paths, settings.min_step_m);
  if (const auto hole_m = middle_of_hole(*paths)) {
    last = blade_at(sweep, *hole_m, last);
    ends.target.reset();
  } else if (!ends.target && crossing.blade_is_in) {
    if (!crossing.opens) return Went::nowhere;
    last = blade_at(sweep, crossing.at_m, last);
  }
  TemplateStep step = cut_with_templates(draft, *stroke.at_front, last, ends, stroke.active, settings);
  if (step.outcome == TemplateOutcome::refused) return refuse(step.why);
  if (step.outcome == TemplateOutcome::nothing) return Went::nowhere;
  if (!stroke.fronts.empty()) {
    const Vec3 way_m = (last.tip_body_m - stroke.at_front->tip_body_m).dot(sweep.ahead) * sweep.ahead;
    for (CutFront& f : step.fronts)
      f.ahead_body = (kHeading_m * stroke.fronts.front().ahead_body + way_m).stableNormalized();
  }
  replace_fronts(stroke, step.fronts, step.starts, grooves);
  if (ends.target) grooves.remove_front(*ends.target);
  for (const VertexId v : step.bottoms) grooves.bottoms.insert(v);
  stroke.fronts = step.fronts;
  stroke.at_front = last;
  stroke.faces.insert(stroke.faces.end(), step.faces.begin(), step.faces.end());
  stroke.bottoms_at_tip.insert(stroke.bottoms_at_tip.end(), step.bottoms_at_tip.begin(), step.bottoms_at_tip.end());
  if (ends.target) return Went::joined;
  return step.fronts.empty() ? Went::left_body : Went::on;
}

// The blade is drawn out, or back along its cut: it leaves open what it has cut, and cuts nothing.
bool draws_back(const TemplateStroke& stroke, const RestBlade& blade, double beside_m) {
  if (!stroke.newest || !stroke.at_front) return false;
  const Vec3 way = blade.tip_body_m - stroke.newest->tip_body_m;
  const double rise_m = way.dot(stroke.newest->up_body);
  const Vec3 along = way - rise_m * stroke.newest->up_body;
  const bool rises = rise_m > along.norm();
  if (stroke.fronts.empty()) return rises;
  const Vec3 &ahead = stroke.fronts.front().ahead_body, &up = stroke.newest->up_body;
  if (rises && along.dot(ahead) < kOnward * rise_m) return true;
  const Vec3 from_front = blade.tip_body_m - stroke.at_front->tip_body_m;
  const Vec3 level = from_front - from_front.dot(up) * up;
  return along.dot(ahead) < 0 && (level - level.dot(ahead) * ahead).norm() < beside_m;
}

}  // namespace

TemplateStrokeEnd advance(MeshDraft& draft, TemplateStroke& stroke, const RestBlade& now,
                          std::span<const TriangleId> active, Grooves& grooves, const TemplateSettings& settings) {
  const RestBlade blade = draws_back(stroke, now, settings.join_tolerance_m) ? *stroke.newest : now;
  take_bottoms_to_tip(draft, stroke);
  stroke.faces.clear();
  if (!stroke.fronts.empty() && !grooves.has_front(stroke.fronts.front())) return TemplateStrokeEnd::joined;
  const std::optional<RestBlade> newest = std::exchange(stroke.newest, blade);
  if (!stroke.at_front) stroke.at_front = blade;
  stroke.active.insert(stroke.active.end(), active.begin(), active.end());
  sort_unique(stroke.active);
  if (newest) deepen_groove(draft, *newest, blade, grooves, active, settings);
  stroke.waits = stroke.fronts.empty() && !take_up_groove(draft, stroke, blade, grooves, settings);
  if (stroke.waits) return TemplateStrokeEnd::going;

  bool went_on = false;
  for (int k = 0; k < kMostSteps; ++k) switch (go_on(draft, stroke, blade, grooves, settings)) {
      case Went::on:
        went_on = true;
        stroke.stuck_since_body_m.reset();
        continue;
      case Went::left_body:
        return TemplateStrokeEnd::left_body;
      case Went::joined:
        return TemplateStrokeEnd::joined;
      case Went::nowhere:
        if (went_on) stroke.active.assign(active.begin(), active.end());
        return TemplateStrokeEnd::going;
      case Went::refused:
        // A stroke may take up a groove whose front is further from the blade than the patience.
        if (!stroke.stuck_since_body_m) stroke.stuck_since_body_m = blade.tip_body_m;
        if ((blade.tip_body_m - *stroke.stuck_since_body_m).norm() < settings.patience_m)
          return TemplateStrokeEnd::going;
        stroke.newest = newest;
        return TemplateStrokeEnd::refused;
    }
  return TemplateStrokeEnd::going;
}

namespace {

// A temporary part that is made anew begins where springs have taken the one before. Else these springs would be
// stretched again at each step of the blade, and drive the vertices around the front to and fro.
void begin_where_last_came_to(MeshDraft& draft, const TemplateStroke& stroke, const Mat3& world_from_rest) {
  const auto is_same = [&](VertexId v, const auto& last) {
    return v == last.first && (draft.rest(v) - last.second.rest_body_m).norm() < kSamePart_m;
  };
  if (!std::ranges::equal(vertices_taken_by(*stroke.temporary_inverse), stroke.last_temporary, is_same)) return;
  for (const auto& [v, last] : stroke.last_temporary) {
    const Vec3 rest_body_m = draft.rest(v);
    draft.move_vertex(v, {rest_body_m, last.position_world_m + world_from_rest * (rest_body_m - last.rest_body_m),
                          last.velocity_world_m_per_s});
  }
}

}  // namespace

void open_temporarily(MeshDraft& draft, TemplateStroke& stroke, const TemplateSettings& settings) {
  if (!stroke.at_front || !stroke.newest || stroke.waits) return;
  if (!goes_on(stroke, sweep_between(draft, *stroke.at_front, *stroke.newest, stroke.fronts), settings)) return;
  const MeshDraft before = draft;
  draft.mark();
  SweepEnds ends = ends_of(stroke);
  ends.may_part = false;
  const TemplateStep step = cut_with_templates(draft, *stroke.at_front, *stroke.newest, ends, stroke.active, settings);
  if (step.outcome != TemplateOutcome::cut) return;
  stroke.temporary_inverse = draft.inverse_since_mark();
  begin_where_last_came_to(draft, stroke, ends.world_from_rest);
  stroke.temporary_fronts = step.fronts;
  stroke.temporary_starts = step.starts;
  for (const VertexEdit& e : stroke.temporary_inverse->vertices)
    if (e.alive) stroke.temporarily_moved.emplace_back(e.id, draft.position(e.id) - before.position(e.id));
  stroke.temporary_bottoms_at_tip = step.bottoms_at_tip;
  stroke.temporary_bottoms = step.bottoms;
}

void keep_what_is_open(const TemplateStroke& stroke, Grooves& grooves) {
  for (const VertexId v : stroke.temporary_bottoms) grooves.bottoms.insert(v);
  if (stroke.temporary_inverse) replace_fronts(stroke, stroke.temporary_fronts, stroke.temporary_starts, grooves);
}

void finish(MeshDraft& draft, TemplateStroke& stroke, Grooves& grooves) {
  take_bottoms_to_tip(draft, stroke);
  take_to(draft, stroke.temporary_bottoms_at_tip);
  keep_what_is_open(stroke, grooves);
  stroke.temporary_inverse.reset();
  stroke.temporarily_moved.clear();
  stroke.temporary_bottoms.clear();
  stroke.fronts.clear();
  stroke.at_front.reset();
}

}  // namespace sectio
