#include "sim_server/surface/cutting/template_cutting.h"

#include <algorithm>
#include <utility>

namespace sectio {

struct TemplateCutting::Ticket final : CutTicket {
  explicit Ticket(TemplateCuts after_plan) : after(std::make_shared<const TemplateCuts>(std::move(after_plan))) {}
  std::shared_ptr<const TemplateCuts> after;
};

CutPlan TemplateCutting::plan(const SharedBody& body, std::span<const Entry> entries,
                              std::span<const BladeMotion> motions) const {
  if (all_wait(entries, motions)) {
    CutPlan unchanged;
    unchanged.going_on = cuts_->edges();
    return unchanged;
  }
  TemplateCutPlan planned = plan_template_cut(body.mesh, body.particles.view(), *cuts_, entries, motions, settings_);
  planned.going_on = planned.after.edges();
  planned.ticket = std::make_shared<Ticket>(std::move(planned.after));
  return planned;
}

void TemplateCutting::accept(const SharedBody&, const CutTicket& planned) {
  cuts_ = static_cast<const Ticket&>(planned).after;  // only its own come back
}

void TemplateCutting::reject() {
  TemplateCuts ended = *cuts_;
  end_where_they_are(ended);
  cuts_ = std::make_shared<const TemplateCuts>(std::move(ended));
}

void TemplateCutting::follow(const SharedBody& body, const TopologyChange& change) {
  const std::vector<VertexId> gone = gone_with(change.delta, body.mesh);
  if (gone.empty()) return;
  TemplateCuts left = *cuts_;
  left.grooves.forget(gone);
  std::erase_if(left.strokes, [&](const TemplateStroke& s) {
    return std::ranges::any_of(gone, [&](VertexId v) { return s.place.stands_on(v); });
  });
  cuts_ = std::make_shared<const TemplateCuts>(std::move(left));
}

std::optional<CutPoint> TemplateCutting::cut_point(const SharedBody& body, std::uint32_t edge_id) const {
  std::optional<CutPoint> found;
  const TemplateStroke* stroke = cuts_->stroke_of(edge_id);
  if (!stroke) return found;
  const PlaceOfStroke& place = stroke->place;
  CutPoint& point = found.emplace();  // not moved in: gcc would take its blade for uninitialized
  point.point_world_m = place.point_world_m;
  point.near = place.corners[0];
  point.follows = place.top;
  point.blade = stroke->blade;
  const MeshDraft now(body.mesh, body.particles.view());
  const auto& v = place.corners;
  if (now.find_triangle(v[0], v[1], v[2]) == kNone) return found;
  point.rest_body_m = VertexState::mix({now.state(v[0]), now.state(v[1]), now.state(v[2])}, place.bary).rest_body_m;
  point.normal_body = rest_normal_of(now, v);
  return found;
}

}  // namespace sectio
