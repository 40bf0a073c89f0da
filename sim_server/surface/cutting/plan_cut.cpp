#include "sim_server/surface/cutting/plan_cut.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "sim_server/surface/cutting/stroke_walk.h"

namespace sectio {

namespace {

// How much of a stroke there is room for in this step.
enum class Share : std::uint8_t {
  moves,
  stays,   // it can't follow its blade
  ends,    // it has stayed for too long; the blade begins anew
  closed,  // not even its end can be opened up to where the blade was
};

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

// An island takes its own half of the bottom along: the vertex with the same place at rest.
void find_bottoms_again(const MeshDraft& draft, Grooves& grooves) {
  std::vector<Rung> found;
  for (const Rung& rung : grooves.rungs) {
    if (draft.triangle_of_edge(rung.lip, rung.bottom) != kNone) continue;
    const Vec3 place = draft.rest(rung.bottom);
    for (const TriangleId t : draft.fan(rung.lip))
      for (const VertexId v : draft.triangle(t).v)
        if (draft.rest(v) == place) found.push_back({rung.lip, v});
  }
  for (const Rung& rung : found) grooves.set_bottom(rung.lip, rung.bottom);
}

struct Debt {
  Share share = Share::moves;
  double owed_m = 0;
};

struct Refusal {
  std::uint32_t edge_id = 0;
  std::string_view why;
  double owed_m = 0;  // from the end of the cut to the blade
};

// One try to advance all strokes of a body.
class Attempt {
 public:
  Attempt(const TriangleMesh& mesh, ParticleView particles, const SurfaceCuts& cuts, const StrokeSettings& settings,
          bool loops_free_islands, const std::map<std::uint32_t, Debt>& shares)
      : now_(mesh, particles),
        draft_(now_),
        cuts_(cuts),
        settings_(settings),
        loops_free_islands_(loops_free_islands),
        shares_(shares) {
    plan.after.grooves = cuts.grooves;
  }

  // Nothing: the plan is made. Else the stroke that there is no room for, and the draft is worth nothing.
  std::optional<Refusal> run(std::span<const Entry> entries, std::span<const BladeMotion> motions) {
    std::vector<Stroke> strokes = cuts_.strokes;
    for (Stroke& s : strokes) s.has_moved = false;
    for (auto it = strokes.rbegin(); it != strokes.rend(); ++it)
      if (!undo_temporary(draft_, *it)) return Refusal{it->edge_id, kChangedBeneath};
    for (const Entry& e : entries) enter(e, strokes);
    for (Stroke& s : strokes) {
      if (const auto refusal = follow(s, motion_of(motions, s.edge_id))) return refusal;
      if (!loops_free_islands_) continue;
      for (const auto& [left, right] : s.met) {
        const auto [island, why_not] = free_island(draft_, plan.after.grooves, left, right);
        if (!why_not.empty()) plan.kept_islands.push_back({s.edge_id, why_not});
        if (!island) continue;
        plan.islands.push_back(*island);
        find_bottoms_again(draft_, plan.after.grooves);
      }
    }
    if (nothing_moved(entries)) return std::nullopt;
    for (Stroke& s : plan.after.strokes)
      if (share_of(s) != Share::closed && !open_temporarily(draft_, s, settings_))
        return Refusal{s.edge_id, "the face that the blade is in can't be opened up to it"};
    for (Stroke& s : plan.after.strokes) s.met.clear();
    plan.delta = draft_.delta();
    plan.seeds = draft_.seeds();
    plan.after.grooves.forget_dead_of(plan.delta);
    return std::nullopt;
  }

  SurfaceCutPlan plan;

 private:
  Share share_of(const Stroke& s) const {
    const auto it = shares_.find(s.edge_id);
    return it != shares_.end() ? it->second.share : Share::moves;
  }

  // Every blade waits: the mesh stays as it is, with the temporary subdivisions that it has.
  bool nothing_moved(std::span<const Entry> entries) {
    if (!entries.empty() || !plan.outcomes.empty() || !plan.islands.empty()) return false;
    if (std::ranges::any_of(plan.after.strokes, [](const Stroke& s) { return s.has_moved; })) return false;
    plan.after.grooves = cuts_.grooves;  // without rungs for branches that were not made
    for (std::size_t i = 0; i < plan.after.strokes.size(); ++i) {
      if (!plan.after.strokes[i].cuts()) continue;
      const BladeSeen seen = plan.after.strokes[i].seen;
      plan.after.strokes[i] = cuts_.strokes[i];
      plan.after.strokes[i].seen = seen;
    }
    return true;
  }

  void enter(Entry e, std::vector<Stroke>& strokes) {
    if (!carry_over(e, now_, draft_, cuts_.strokes)) {
      ++plan.refused;
      plan.outcomes.push_back({e.edge_id, StrokeEnd::refused, "the surface where the cut begins is gone"});
      return;
    }
    Stroke s;
    s.edge_id = e.edge_id;
    const BladePlace place = place_on_skin(draft_, e.triangle, e.bary);
    s.touched = draft_.triangle(place.triangle).v;
    s.bary = place.bary;
    strokes.push_back(std::move(s));
  }

  std::optional<Refusal> follow(Stroke& s, const BladeMotion* motion) {
    const bool moves = motion && share_of(s) == Share::moves;
    StrokeEnd end = StrokeEnd::going;
    if (share_of(s) != Share::moves) s.seen.owed_m = shares_.at(s.edge_id).owed_m;
    if (moves) {
      std::vector<TriangleId> near = motion->active;
      s.seen.has_dragged_end = motion->has_dragged_end;
      for (const Blade& blade : motion->path) {
        near.resize(motion->active.size());
        draft_.append_edited(near);
        end = advance(draft_, s, blade, near, plan.after.grooves, settings_);
        s.seen.has_dragged_end = false;
        if (end == StrokeEnd::refused) return Refusal{s.edge_id, s.why_refused, s.seen.owed_m};
        if (end == StrokeEnd::joined) plan.outcomes.push_back({s.edge_id, end});
        if (end == StrokeEnd::lifted) break;
      }
    }
    const bool is_lifted = end == StrokeEnd::lifted || (motion && motion->lift);
    if (!is_lifted && (!s.cuts() || share_of(s) < Share::ends)) {
      plan.after.strokes.push_back(s);
      return std::nullopt;
    }
    if (is_lifted) plan.outcomes.push_back({s.edge_id, StrokeEnd::lifted});
    const auto refusal = end_cut(s);
    if (is_lifted || refusal) return refusal;
    if (s.cuts()) stand_beside(draft_, s, s.cell.apex);
    s.seen.begins_anew = true;
    plan.after.strokes.push_back(s);
    return std::nullopt;
  }

  std::optional<Refusal> end_cut(Stroke& s) {
    s.temporary_inverse.reset();
    if (share_of(s) == Share::closed) {
      keep_what_is_open(s, plan.after.grooves);
      return std::nullopt;
    }
    if (!open_temporarily(draft_, s, settings_) || !finish(draft_, s, plan.after.grooves))
      return Refusal{s.edge_id, "the end of the cut can't be closed"};
    return std::nullopt;
  }

  const MeshDraft now_;
  MeshDraft draft_;
  const SurfaceCuts& cuts_;
  const StrokeSettings& settings_;
  const bool loops_free_islands_;
  const std::map<std::uint32_t, Debt>& shares_;
};

SurfaceCutPlan refuse_all(const SurfaceCuts& cuts, std::span<const Entry> entries, std::string_view why) {
  SurfaceCutPlan plan;
  plan.after = cuts;
  end_where_they_are(plan.after);
  plan.refused = 1;
  for (const Stroke& s : cuts.strokes) plan.outcomes.push_back({s.edge_id, StrokeEnd::refused, why});
  for (const Entry& e : entries) plan.outcomes.push_back({e.edge_id, StrokeEnd::refused, why});
  return plan;
}

}  // namespace

SurfaceCutPlan plan_cut(const TriangleMesh& mesh, ParticleView particles, const SurfaceCuts& cuts,
                        std::span<const Entry> entries, std::span<const BladeMotion> motions,
                        const StrokeSettings& settings, bool loops_free_islands) {
  if (all_wait(entries, motions)) {
    SurfaceCutPlan unchanged;
    unchanged.after = cuts;
    return unchanged;
  }
  std::map<std::uint32_t, Debt> shares;
  std::vector<StrokeOutcome> refused;
  for (std::size_t tries = 0; tries <= 3 * (cuts.strokes.size() + entries.size()); ++tries) {
    Attempt attempt(mesh, particles, cuts, settings, loops_free_islands, shares);
    const auto refusal = attempt.run(entries, motions);
    if (!refusal) {
      attempt.plan.refused += static_cast<std::uint32_t>(refused.size());
      attempt.plan.outcomes.insert(attempt.plan.outcomes.end(), refused.begin(), refused.end());
      return std::move(attempt.plan);
    }
    if (refusal->why == kChangedBeneath) return refuse_all(cuts, entries, refusal->why);
    Debt& debt = shares[refusal->edge_id];
    if (debt.share == Share::moves)
      debt = {refusal->owed_m > settings.most_owed_m ? Share::ends : Share::stays, refusal->owed_m};
    else
      debt.share = Share::closed;
    if (debt.share != Share::stays) refused.push_back({refusal->edge_id, StrokeEnd::refused, refusal->why});
  }
  return refuse_all(cuts, entries, "there is no room for the cuts");
}

std::optional<InOpenCut> in_open_cut(const TriangleMesh& mesh, ParticleView particles, const SurfaceCuts& cuts,
                                     const Blade& blade) {
  Grooves grooves = cuts.grooves;
  for (const Stroke& s : cuts.strokes) add_temporary(s, grooves);
  if (grooves.rungs.empty()) return std::nullopt;
  const MeshDraft now(mesh, particles);
  const auto place = place_on_lid(now, grooves, blade);
  if (!place) return std::nullopt;
  return InOpenCut{place->point_world_m, now.triangle_of_edge(place->lid.lip.from, place->lid.lip.to)};
}

void end_where_they_are(SurfaceCuts& cuts) {
  for (Stroke& s : cuts.strokes) keep_what_is_open(s, cuts.grooves);
  cuts.strokes.clear();
}

}  // namespace sectio
