// Short edges that cuts have left go, one a step while no instrument is at the body. What that does to the surface is a
// delta like a cut's; inside there is none.
#include <algorithm>
#include <utility>

#include "sim_server/volume/tets/collapse.h"
#include "sim_server/volume/volume_cutting.h"

namespace sectio {
namespace {

constexpr VertexId kTidied = 64;  // vertices that are looked at in a step

}  // namespace

TopologyDelta VolumeCutting::tidy(const SharedBody& body) {
  collapsing_.reset();
  settle();
  TopologyDelta delta;
  if (tidied_ == kNone || !(cut_settings_.collapse_ratio > 0) || body.mesh.has_temporary_elements()) return delta;
  volume_.fetch_states_from([&](VertexId v) { return state_of(body, v); });
  const auto kind = [&](const Corners3& corners) {
    return static_cast<int>(body.mesh.triangle(surface_.triangle_of(body.mesh, corners)).surface);
  };
  const auto end = static_cast<VertexId>(std::min<std::size_t>(tidied_ + kTidied, volume_.vertex_count()));
  while (tidied_ < end && !collapsing_) {
    const VertexId v = tidied_++;
    if (is_fixed_ && is_fixed_(volume_.vertex(v).rest_body_m)) continue;
    if (const auto onto = collapse_onto(volume_, v, cut_settings_.collapse_ratio, kind))
      plan_collapse(body, v, *onto, delta);
  }
  if (tidied_ == volume_.vertex_count()) tidied_ = std::exchange(has_collapsed_, false) ? 0 : kNone;
  volume_.fetch_states_from({});
  if (collapsing_ && delta.empty()) collapse(body);
  return delta;
}

void VolumeCutting::plan_collapse(const SharedBody& body, VertexId v, VertexId onto, TopologyDelta& delta) {
  Collapsing planned{v, onto, {}, 0};
  const BoundaryChange boundary = boundary_change(volume_.collapse_change(v, onto).tetrahedra);
  MeshDraft draft(body.mesh, body.particles.view());
  const auto state = [&](VertexId u) {
    const TetVertexState& s = volume_.vertex(u);
    return VertexState{s.rest_body_m, s.position_world_m, s.velocity_m_per_s};
  };
  const auto kind = [&](Corners3 corners) {  // that of the triangle that moves along
    std::ranges::replace(corners, onto, v);
    return body.mesh.triangle(surface_.triangle_of(body.mesh, corners)).surface;
  };
  if (!surface_.plan(body.mesh, boundary, {}, state, kind, draft, planned.slots)) return;
  delta = draft.delta();
  planned.hash = delta.hash_after;
  collapsing_ = std::move(planned);
}

void VolumeCutting::collapse(const SharedBody& body) {
  const Collapsing done = *std::exchange(collapsing_, {});
  std::vector<VertexId> around;
  for (const std::uint32_t t : volume_.star(done.v))
    around.insert(around.end(), volume_.tetrahedra()[t].begin(), volume_.tetrahedra()[t].end());
  const Momentum before = momentum(body, std::move(around));
  std::vector<VolumeDeformation::Slot> freed;
  for (const VertexId slot : done.slots.freed) freed.push_back({slot, kNone});
  engine_.change(volume_.collapse(done.v, done.onto), {}, {}, freed);
  surface_.accept(done.slots);
  has_collapsed_ = true;
  ++edges_collapsed_;
  for (auto& [tool, way] : ways_)
    for (auto* list : {&way.cut, &way.near}) std::erase(*list, done.v);
  keep(body, before);
}

}  // namespace sectio
