#include "sim_server/surface/cutting/surface_cutting.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "sim_server/surface/cutting/stroke_walk.h"

namespace sectio {

struct SurfaceCutting::Ticket final : CutTicket {
  Ticket(SurfaceCuts after_plan, LipSearch search_then)
      : after(std::make_shared<const SurfaceCuts>(std::move(after_plan))), search(search_then) {}
  std::shared_ptr<const SurfaceCuts> after;
  LipSearch search;
};

// A blade whose cut has met another one is in the groove still when a piece leaves beside it: at the rim of the hole,
// over which it goes on.
void SurfaceCutting::stand_at_rim(const MeshDraft& now, const Grooves& grooves, Stroke& stroke) const {
  if (!stroke.seen.on_lid_body_m) return;
  if (const auto rim = nearest_on_curves(now, grooves, *stroke.seen.on_lid_body_m, settings_.leaves_m))
    stand_beside(now, stroke, rim->lip.from);
}

CutPlan SurfaceCutting::plan(const SharedBody& body, std::span<const Entry> entries,
                             std::span<const BladeMotion> motions) const {
  if (all_wait(entries, motions)) {
    CutPlan unchanged;
    unchanged.going_on = cuts_->edges();
    return unchanged;
  }
  SurfaceCutPlan planned =
      plan_cut(body.mesh, body.particles.view(), *cuts_, entries, motions, settings_, loops_free_islands_);
  planned.going_on = planned.after.edges();
  LipSearch from_the_first = search_;
  from_the_first.next = 0;
  from_the_first.has_changed = false;
  planned.ticket = std::make_shared<Ticket>(std::move(planned.after), from_the_first);
  return planned;
}

void SurfaceCutting::accept(const SharedBody&, const CutTicket& planned) {
  const auto& ticket = static_cast<const Ticket&>(planned);  // only its own come back
  cuts_ = ticket.after;
  search_ = ticket.search;
}

TidyPlan SurfaceCutting::tidy(const SharedBody& body) const {
  if (search_.next == kNone || !cuts_->strokes.empty() || cuts_->grooves.rungs.empty()) return {};
  TidiedLips tidied = tidy_lips(body.mesh, body.particles.view(), cuts_->grooves, search_);
  return {std::move(tidied.delta), tidied.edges_collapsed,
          std::make_shared<Ticket>(SurfaceCuts{std::move(tidied.grooves), {}}, tidied.search)};
}

void SurfaceCutting::reject() {
  SurfaceCuts ended = *cuts_;
  end_where_they_are(ended);
  cuts_ = std::make_shared<const SurfaceCuts>(std::move(ended));
}

void SurfaceCutting::follow(const SharedBody& body, const TopologyChange& change) {
  const std::vector<VertexId> gone = gone_with(change.delta, body.mesh);
  if (gone.empty()) return;
  const auto is_gone = [&](VertexId v) { return std::ranges::binary_search(gone, v); };
  SurfaceCuts left = *cuts_;
  left.grooves.forget(gone);
  const MeshDraft now(body.mesh, body.particles.view());
  for (Stroke& s : left.strokes) {
    if (is_gone(s.first)) s.first = kNone;
    if (!s.cuts() && std::ranges::any_of(s.touched, is_gone)) stand_at_rim(now, left.grooves, s);
  }
  std::erase_if(left.strokes, [&](const Stroke& s) {
    if (!s.cuts()) return std::ranges::any_of(s.touched, is_gone);
    return is_gone(s.cell.apex) || is_gone(s.start) || is_gone(s.bottom) || is_gone(s.temporary_tip) ||
           std::ranges::any_of(s.cell.rim, is_gone);
  });
  cuts_ = std::make_shared<const SurfaceCuts>(std::move(left));
}

std::optional<CutPoint> SurfaceCutting::cut_point(const SharedBody& body, std::uint32_t edge_id) const {
  const Stroke* stroke = cuts_->stroke_of(edge_id);
  if (!stroke) return std::nullopt;
  const MeshDraft now(body.mesh, body.particles.view());
  const bool is_known =
      stroke->cuts() || now.find_triangle(stroke->touched[0], stroke->touched[1], stroke->touched[2]) != kNone;
  CutPoint point;
  point.cuts = stroke->cuts();
  point.point_world_m = stroke->seen.at_world_m;
  point.near = stroke->cuts() ? stroke->cell.apex : stroke->touched[0];
  point.follows = stroke->temporary_tip != kNone ? stroke->temporary_tip : stroke->cell.apex;
  point.blade = stroke->blade;
  point.owed_m = stroke->seen.owed_m;
  if (!is_known) return point;
  if (!point.point_world_m) point.point_world_m = position_of(now, *stroke);
  point.rest_body_m = rest_of(now, *stroke);
  point.normal_body = rest_normal_of(now, *stroke);
  return point;
}

bool SurfaceCutting::is_temporary(std::span<const TriangleId> triangles) const {
  for (const Stroke& stroke : cuts_->strokes) {
    if (!stroke.temporary_inverse) continue;
    for (const TriangleEdit& e : stroke.temporary_inverse->triangles)
      if (std::ranges::binary_search(triangles, e.id)) return true;
  }
  return false;
}

}  // namespace sectio
