#include "sim_server/cutting/template_stroke.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace sectio {

std::size_t deepen_groove(MeshDraft& draft, const Blade& first, const Blade& last, const GrooveBottoms& bottoms,
                          std::span<const TriangleId> active, const TemplateSettings& settings) {
  const BladeSweep sweep = sweep_between(draft, first, last, std::nullopt);
  if (!(sweep.length_m() >= settings.min_step_m)) return 0;
  std::vector<TriangleId> open(active.begin(), active.end());
  std::set<TriangleId> seen(open.begin(), open.end());
  std::set<VertexId> moved;
  for (std::size_t k = 0; k < open.size(); ++k) {
    const Triangle t = draft.triangle(open[k]);
    if (!t.alive()) continue;
    bool reached = false;
    for (const VertexId v : t.v) {
      if (!bottoms.contains(v)) continue;
      const Vec3 x = draft.position(v);
      const Vec2 at = sweep.in_plane(x);
      if (at.x() < sweep.tip_first().x() || at.x() > sweep.tip_last().x()) continue;
      if (std::abs(sweep.side(x)) > settings.open_top_m) continue;
      reached = true;
      const double down_m = at.y() - sweep.trail_height(at.x());
      if (down_m <= 0 || !moved.insert(v).second) continue;
      const Mat3 to_rest = rest_from_world(draft, t.v);
      const VertexState s = draft.state(v);
      const Vec3 down = -down_m * sweep.up;
      draft.move_vertex(v, {s.rest_body_m + to_rest * down, s.position_world_m + down, s.velocity_world_m_per_s});
    }
    if (!reached) continue;
    for (int i = 0; i < 3; ++i) {
      const TriangleId next = draft.neighbour(open[k], i);
      if (draft.triangle(next).surface == Surface::wall && seen.insert(next).second) open.push_back(next);
    }
  }
  return moved.size();
}

namespace {

void take_bottoms_to_tip(MeshDraft& draft, TargetStates& targets) {
  for (const auto& [v, state] : targets)
    if (draft.incident(v) != kNone) {
      VertexState s = state;
      s.velocity_world_m_per_s = draft.state(v).velocity_world_m_per_s;
      draft.move_vertex(v, s);
    }
  targets.clear();
}

// The upper end of the blade's line in the body at the end of a sweep: its path, and the last of the path's points
// that is not inside a face.
struct LastCrossing {
  bool blade_is_in = false;
  bool opens = false;  // there is a point behind it that becomes a pair
  Vec2 at = Vec2::Zero();
};
LastCrossing last_crossing(const std::vector<SurfacePath>& paths, bool from_front, double min_step_m) {
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
  c.at = top->points[k].at;
  for (std::size_t i = from_front && top == &paths.front() ? 0 : 1; i < k; ++i)
    c.opens |= top->points[i].at.x() <= c.at.x() - min_step_m;
  return c;
}

}  // namespace

bool undo_temporary(MeshDraft& draft, TemplateStroke& stroke) {
  if (!stroke.temporary_inverse) return true;
  const bool undone = draft.undo(*stroke.temporary_inverse);
  for (const auto& [v, by_world] : stroke.temporarily_moved) {
    if (!undone) break;
    VertexState state = draft.state(v);
    state.position_world_m -= by_world;
    draft.move_vertex(v, state);
  }
  stroke.temporarily_moved.clear();
  stroke.temporary_front.reset();
  stroke.temporary_inverse.reset();
  stroke.temporary_bottoms_at_tip.clear();
  stroke.temporary_bottoms.clear();
  return undone;
}

TemplateStrokeEnd advance(MeshDraft& draft, TemplateStroke& stroke, const Blade& blade,
                          std::span<const TriangleId> active, GrooveBottoms& bottoms,
                          const TemplateSettings& settings) {
  take_bottoms_to_tip(draft, stroke.bottoms_at_tip);
  if (stroke.front) stroke.front->bottom_at_tip.reset();
  stroke.faces.clear();
  const std::optional<Blade> newest = std::exchange(stroke.newest, blade);
  if (!stroke.at_front) stroke.at_front = blade;
  stroke.active.insert(stroke.active.end(), active.begin(), active.end());
  std::sort(stroke.active.begin(), stroke.active.end());
  stroke.active.erase(std::unique(stroke.active.begin(), stroke.active.end()), stroke.active.end());

  const BladeSweep sweep = sweep_between(draft, *stroke.at_front, blade, stroke.front);
  if (!(sweep.length_m() >= settings.min_step_m)) return TemplateStrokeEnd::going;
  const auto paths = sweep_paths(draft, sweep, stroke.front, stroke.active, settings.snap_ratio, settings.inset);
  const auto refuse = [&] {
    stroke.newest = newest;
    return TemplateStrokeEnd::refused;
  };
  if (!paths) return refuse();
  if (paths->empty()) return TemplateStrokeEnd::going;
  const LastCrossing crossing = last_crossing(*paths, stroke.front.has_value(), settings.min_step_m);
  if (crossing.blade_is_in && !crossing.opens) return TemplateStrokeEnd::going;
  Blade at_crossing = blade;
  if (crossing.blade_is_in)
    at_crossing.tip_world_m =
        sweep.origin + crossing.at.x() * sweep.ahead + sweep.trail_height(crossing.at.x()) * sweep.up;
  const TemplateStep step =
      cut_with_templates(draft, *stroke.at_front, at_crossing, stroke.front, stroke.active, settings);
  if (step.outcome == TemplateOutcome::refused) return refuse();
  if (step.outcome == TemplateOutcome::nothing) return TemplateStrokeEnd::going;
  stroke.front = step.front;
  stroke.at_front = at_crossing;
  stroke.active.assign(active.begin(), active.end());
  stroke.faces = step.faces;
  stroke.bottoms_at_tip = step.bottoms_at_tip;
  bottoms.insert(step.bottoms.begin(), step.bottoms.end());
  return step.front ? TemplateStrokeEnd::going : TemplateStrokeEnd::left_body;
}

void open_temporarily(MeshDraft& draft, TemplateStroke& stroke, const TemplateSettings& settings) {
  if (!stroke.at_front || !stroke.newest) return;
  const MeshDraft before = draft;
  draft.mark();
  const TemplateStep step =
      cut_with_templates(draft, *stroke.at_front, *stroke.newest, stroke.front, stroke.active, settings);
  if (step.outcome != TemplateOutcome::cut) return;
  stroke.temporary_inverse = draft.inverse_since_mark();
  stroke.temporary_front = step.front;
  for (const VertexEdit& e : stroke.temporary_inverse->vertices)
    if (e.alive) stroke.temporarily_moved.emplace_back(e.id, draft.position(e.id) - before.position(e.id));
  stroke.temporary_bottoms_at_tip = step.bottoms_at_tip;
  stroke.temporary_bottoms = step.bottoms;
}

void finish(MeshDraft& draft, TemplateStroke& stroke, GrooveBottoms& bottoms) {
  take_bottoms_to_tip(draft, stroke.bottoms_at_tip);
  take_bottoms_to_tip(draft, stroke.temporary_bottoms_at_tip);
  bottoms.insert(stroke.temporary_bottoms.begin(), stroke.temporary_bottoms.end());
  stroke.temporary_inverse.reset();
  stroke.temporarily_moved.clear();
  stroke.temporary_bottoms.clear();
  stroke.front.reset();
  stroke.at_front.reset();
}

}  // namespace sectio
