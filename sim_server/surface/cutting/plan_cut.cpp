#include "sim_server/surface/cutting/plan_cut.h"

#include <algorithm>
#include <optional>

namespace sectio {

const Stroke* BodyCuts::stroke_of(std::uint32_t edge_id) const {
  const auto it = std::find_if(strokes.begin(), strokes.end(), [&](const Stroke& s) { return s.edge_id == edge_id; });
  return it != strokes.end() ? &*it : nullptr;
}

const BladeMotion* motion_of(std::span<const BladeMotion> motions, std::uint32_t edge_id) {
  const auto it =
      std::find_if(motions.begin(), motions.end(), [&](const BladeMotion& m) { return m.edge_id == edge_id; });
  return it != motions.end() ? &*it : nullptr;
}

namespace {

constexpr std::string_view kCantReachBlade = "the face that the blade is in can't be opened up to it";

StrokeEnd follow(MeshDraft& draft, Stroke& stroke, const BladeMotion* motion, GrooveDraft& grooves,
                 const StrokeSettings& settings) {
  if (!motion) return StrokeEnd::going;
  for (const Blade& blade : motion->path) {
    const StrokeEnd end = advance(draft, stroke, blade, grooves, settings);
    if (end != StrokeEnd::going) return end;
    stroke.blade = blade;
  }
  return motion->lift ? StrokeEnd::lifted : StrokeEnd::going;
}

// Moves an entry to the surface without temporary subdivisions, which lie in the cells of the strokes.
bool carry_over(Entry& e, const MeshDraft& with_temporaries, const MeshDraft& without,
                std::span<const Stroke> strokes) {
  const Triangle found = with_temporaries.triangle(e.triangle);
  if (!found.alive()) return false;
  if (without.triangle(e.triangle) == found) return true;
  const Vec3 point = e.bary[0] * with_temporaries.position(found.v[0]) +
                     e.bary[1] * with_temporaries.position(found.v[1]) +
                     e.bary[2] * with_temporaries.position(found.v[2]);
  std::vector<TriangleId> cells;
  for (const Stroke& s : strokes)
    for (const TriangleId t : triangles_of(without, s.cell)) cells.push_back(t);
  const SurfacePoint at = nearest_on(without, cells, point);
  e.triangle = at.triangle;
  e.bary = at.bary;
  return at.triangle != kNone;
}

// Advances all strokes of a body at once. A stroke that has no valid continuation makes the attempt fail: the reason.
std::optional<std::string_view> attempt(const MeshDraft& now, MeshDraft& draft, CutPlan& plan, const BodyCuts& cuts,
                                        std::span<const Entry> entries, std::span<const BladeMotion> motions,
                                        const StrokeSettings& settings, bool loops_free_islands) {
  std::vector<Stroke> strokes = cuts.strokes;
  for (auto it = strokes.rbegin(); it != strokes.rend(); ++it)
    if (!undo_temporary(draft, *it)) return kChangedBeneath;
  for (Entry e : entries) {
    if (!carry_over(e, now, draft, cuts.strokes)) return "the surface where the cut begins is gone";
    Stroke s;
    s.edge_id = e.edge_id;
    s.touched = draft.triangle(e.triangle).v;
    s.bary = e.bary;
    strokes.push_back(s);
  }

  std::vector<Stroke> ended;
  for (Stroke& s : strokes) {
    const StrokeEnd end = follow(draft, s, motion_of(motions, s.edge_id), plan.grooves, settings);
    if (end == StrokeEnd::refused) return s.why_refused;
    if (end == StrokeEnd::going) {
      plan.strokes.push_back(s);
      continue;
    }
    plan.outcomes.push_back({s.edge_id, end});
    s.temporary_inverse.reset();
    if (end == StrokeEnd::lifted && s.blade && !open_temporarily(draft, s, *s.blade, settings)) return kCantReachBlade;
    if (end != StrokeEnd::joined && !finish(draft, s, plan.grooves)) return "the end of the cut can't be closed";
    ended.push_back(s);
  }
  if (loops_free_islands)
    for (const Stroke& s : ended)
      if (s.joined_twin != kNone)
        if (const auto island = free_island(draft, plan.grooves, s.cell.apex, s.joined_twin))
          plan.islands.push_back(*island);
  for (Stroke& s : plan.strokes)
    if (s.blade && !open_temporarily(draft, s, *s.blade, settings)) return kCantReachBlade;
  return {};
}

bool at_rest(const BladeMotion& motion) {
  return motion.path.empty() && !motion.lift;
}

}  // namespace

CutPlan plan_cut(const TriangleMesh& mesh, ParticleView particles, const BodyCuts& cuts, std::span<const Entry> entries,
                 std::span<const BladeMotion> motions, const StrokeSettings& settings, bool loops_free_islands) {
  if (entries.empty() && std::ranges::all_of(motions, at_rest)) {
    CutPlan unchanged(cuts);
    unchanged.strokes = cuts.strokes;
    unchanged.template_strokes = cuts.template_strokes;
    return unchanged;
  }
  if (settings.style == CutStyle::templates)
    return plan_with_templates(mesh, particles, cuts, entries, motions, settings);
  CutPlan plan(cuts);
  const MeshDraft now(mesh, particles);
  MeshDraft draft = now;
  const auto why = attempt(now, draft, plan, cuts, entries, motions, settings, loops_free_islands);
  if (!why) {
    plan.delta = draft.delta();
    plan.seeds = draft.seeds();
    return plan;
  }
  // The whole step is refused: the mesh stays, and cuts that were under way end with their present opening.
  CutPlan refusal(cuts);
  refusal.refused = 1;
  for (Stroke s : cuts.strokes) {
    keep_what_is_open(s, refusal.grooves);
    refusal.outcomes.push_back({s.edge_id, StrokeEnd::refused, *why});
  }
  for (const Entry& e : entries) refusal.outcomes.push_back({e.edge_id, StrokeEnd::refused, *why});
  return refusal;
}

bool accept(const CutPlan& plan, TriangleMesh& mesh, BodyCuts& cuts) {
  if (!plan.delta.empty() && apply(plan.delta, mesh) != ApplyStatus::applied) {
    GrooveDraft grooves(cuts.grooves);
    for (Stroke& s : cuts.strokes) keep_what_is_open(s, grooves);
    for (const TemplateStroke& s : cuts.template_strokes) keep_what_is_open(s, grooves);
    grooves.commit(cuts.grooves);
    cuts.strokes.clear();
    cuts.template_strokes.clear();
    return false;
  }
  plan.grooves.commit(cuts.grooves);
  cuts.strokes = plan.strokes;
  cuts.template_strokes = plan.template_strokes;
  std::vector<VertexId> dead;
  for (const VertexEdit& e : plan.delta.vertices)
    if (!e.alive) dead.push_back(e.id);
  cuts.grooves.forget(dead);
  return true;
}

}  // namespace sectio
