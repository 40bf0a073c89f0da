#include "sim_server/surface/cutting/plan_template_cut.h"

#include <algorithm>
#include <utility>

namespace sectio {
namespace {

// The share of one step in the smoothed displacement of the tissue, so that lips that draw back don't shake the path;
// and along the blade, where skin that was pressed in springs back.
constexpr double kFollowedShare = 0.02, kFollowedAlongShare = 0.2;

constexpr double kIn_m = 2e-4;  // a tip this deep is through the skin, which springs back when it breaks

// The triangles of a list that are alive, and the triangles around the corners of `entry`.
std::vector<TriangleId> alive_around(const MeshDraft& draft, const Triangle& entry) {
  std::vector<TriangleId> result;
  for (const VertexId v : entry.v)
    for (const TriangleId t : draft.fan(v)) result.push_back(t);
  return result;
}

VertexId top_of(const TemplateStroke& s) {
  return !s.temporary_fronts.empty() ? s.temporary_fronts.front().top
         : !s.fronts.empty()         ? s.fronts.front().top
                                     : kNone;
}

// A quantity of vertices at a place in a triangle.
template <class Of>
Vec3 mean(const std::array<VertexId, 3>& v, const Vec3& bary, const Of& of) {
  return bary[0] * of(v[0]) + bary[1] * of(v[1]) + bary[2] * of(v[2]);
}

// The upper end of the cut where the tissue around it takes it: a lip may swing about.
Vec3 surface_point(const MeshDraft& draft, const TemplateStroke& s) {
  if (const VertexId top = top_of(s); top != kNone)
    return s.frame_world && s.displacement_body_m ? s.frame_world->to_world(draft.rest(top) + *s.displacement_body_m)
                                                  : draft.position(top);
  return mean(s.touched, s.bary, [&](VertexId v) -> Vec3 { return draft.position(v); });
}

PlaceOfStroke place_of(const MeshDraft& draft, const TemplateStroke& stroke) {
  PlaceOfStroke place{stroke.touched, stroke.bary, top_of(stroke), surface_point(draft, stroke)};
  if (place.top == kNone) return place;
  for (const TriangleId t : draft.fan(place.top)) {
    const Triangle triangle = draft.triangle(t);
    place.corners = triangle.v;
    place.bary = Vec3::Unit(triangle.corner_of(place.top));
    if (triangle.surface == Surface::skin) break;
  }
  return place;
}

// The displacement of the tissue at the instrument from its place at rest, in the frame of the body; it takes the blade
// to the body at rest. The mean over the skin around the top of the cut shakes less than one vertex.
Vec3 displacement_body_m(const MeshDraft& draft, const TemplateStroke& s, const Pose& frame_world) {
  const auto displacement = [&](VertexId v) -> Vec3 { return frame_world.to_local(draft.position(v)) - draft.rest(v); };
  const VertexId top = top_of(s);
  if (top == kNone) return mean(s.touched, s.bary, displacement);
  std::set<VertexId> around{top};
  for (const TriangleId t : draft.fan(top))
    if (const Triangle skin = draft.triangle(t); skin.surface == Surface::skin)
      around.insert(skin.v.begin(), skin.v.end());
  Vec3 sum = Vec3::Zero();
  for (const VertexId v : around) sum += displacement(v);
  return sum / static_cast<double>(around.size());
}

void follow_tissue(const MeshDraft& draft, TemplateStroke& stroke, const Pose& frame_world) {
  stroke.frame_world = frame_world;
  const Vec3 now_m = displacement_body_m(draft, stroke, frame_world);
  if (!stroke.newest) {
    stroke.displacement_body_m = now_m;
    return;
  }
  const Vec3 moved_m = now_m - *stroke.displacement_body_m, &up = stroke.newest->up_body;
  const Vec3 along_m = moved_m.dot(up) * up;
  *stroke.displacement_body_m += kFollowedShare * (moved_m - along_m) + kFollowedAlongShare * along_m;
}

StrokeEnd follow(MeshDraft& draft, TemplateStroke& stroke, const BladeMotion& motion, Grooves& grooves,
                 const TemplateSettings& settings) {
  follow_tissue(draft, stroke, motion.frame_world);
  for (const Blade& blade : motion.path) {
    const std::optional<RestBlade> newest = stroke.newest;
    const auto depth_m = [&] { return (surface_point(draft, stroke) - blade.tip_world_m).dot(blade.up_world); };
    stroke.blade = blade;
    if (!newest && !stroke.begins_at_wall && depth_m() <= kIn_m) {
      if (depth_m() < -settings.join_tolerance_m) return StrokeEnd::lifted;  // pressed skin swings
      continue;
    }
    const RestBlade at_rest{motion.frame_world.to_local(blade.tip_world_m) - *stroke.displacement_body_m,
                            motion.frame_world.orientation.conjugate() * blade.up_world};
    switch (advance(draft, stroke, at_rest, motion.active, grooves, settings)) {
      case TemplateStrokeEnd::refused:
        return StrokeEnd::refused;
      case TemplateStrokeEnd::left_body:
        return StrokeEnd::lifted;
      case TemplateStrokeEnd::joined:
        return StrokeEnd::joined;
      case TemplateStrokeEnd::going:
        break;
    }
    const bool is_on_wall = stroke.begins_at_wall && top_of(stroke) == kNone;  // deep in a groove
    if (!is_on_wall && depth_m() < settings.release_depth_m) {
      stroke.newest = newest;
      return StrokeEnd::lifted;
    }
  }
  return motion.lift ? StrokeEnd::lifted : StrokeEnd::going;
}

}  // namespace

void end_where_they_are(TemplateCuts& cuts) {
  for (const TemplateStroke& s : cuts.strokes) keep_what_is_open(s, cuts.grooves);
  cuts.strokes.clear();
}

TemplateCutPlan plan_template_cut(const TriangleMesh& mesh, ParticleView particles, const TemplateCuts& cuts,
                                  std::span<const Entry> entries, std::span<const BladeMotion> motions,
                                  const TemplateSettings& settings) {
  TemplateCutPlan plan;
  plan.after.grooves = cuts.grooves;
  const MeshDraft now(mesh, particles);
  MeshDraft draft = now;
  std::vector<TemplateStroke> strokes = cuts.strokes;
  for (auto it = strokes.rbegin(); it != strokes.rend(); ++it) {
    if (undo_temporary(draft, *it)) continue;
    for (const TemplateStroke& s : cuts.strokes) {
      plan.outcomes.push_back({s.edge_id, StrokeEnd::refused, kChangedBeneath});
      keep_what_is_open(s, plan.after.grooves);
    }
    for (const Entry& e : entries) plan.outcomes.push_back({e.edge_id, StrokeEnd::refused, kChangedBeneath});
    ++plan.refused;
    return plan;
  }
  for (const Entry& e : entries) {
    TemplateStroke s;
    s.edge_id = e.edge_id;
    Triangle entry = now.triangle(e.triangle);
    if (draft.triangle(e.triangle).alive()) entry = draft.triangle(e.triangle);
    s.touched = entry.v;
    s.bary = e.bary;
    s.entered_body_m = mean(entry.v, e.bary, [&](VertexId v) -> Vec3 { return draft.rest(v); });
    s.begins_at_wall = entry.surface == Surface::wall;
    s.active = alive_around(draft, entry);
    strokes.push_back(std::move(s));
  }

  for (TemplateStroke& s : strokes) take_bottoms_to_tip(draft, s);

  for (TemplateStroke& s : strokes) {
    const BladeMotion* const motion = motion_of(motions, s.edge_id);
    const StrokeEnd end = motion ? follow(draft, s, *motion, plan.after.grooves, settings) : StrokeEnd::going;
    if (end == StrokeEnd::going) {
      plan.after.strokes.push_back(s);
      continue;
    }
    plan.refused += end == StrokeEnd::refused;
    plan.outcomes.push_back({s.edge_id, end, end == StrokeEnd::refused ? s.why_refused : std::string_view()});
    if (end != StrokeEnd::joined) open_temporarily(draft, s, settings);
    finish(draft, s, plan.after.grooves);
  }
  for (TemplateStroke& s : plan.after.strokes) {
    open_temporarily(draft, s, settings);
    s.place = place_of(draft, s);
  }
  plan.delta = draft.delta();
  plan.seeds = draft.seeds();
  plan.after.grooves.forget_dead_of(plan.delta);
  return plan;
}

}  // namespace sectio
