#include "sim_server/volume/collapse_edges.h"

#include <algorithm>
#include <utility>

#include "common/core/sort_unique.h"
#include "sim_server/volume/tets/boundary_change.h"
#include "sim_server/volume/tets/collapse.h"

namespace sectio {
namespace {

constexpr VertexId kVerticesAStep = 64;

// Nothing when the surface would be no manifold.
std::optional<EdgeCollapse> plan_one(const Volume& volume, const SharedBody& body, VertexId v, VertexId onto,
                                     TopologyDelta& delta) {
  EdgeCollapse planned{v, onto, {}};
  const BoundaryChange boundary = boundary_change(volume.topology.collapse_change(v, onto).tetrahedra);
  MeshDraft draft(body.mesh, body.particles.view());
  const auto state = [&](VertexId u) {
    const TetVertexState s = volume.state_of(body, u);
    return VertexState{s.rest_body_m, s.position_world_m, s.velocity_m_per_s};
  };
  const auto label = [&](Corners3 corners) {  // the label of the triangle that moves along
    std::ranges::replace(corners, onto, v);
    return body.mesh.triangle(volume.surface.triangle_of(body.mesh, corners)).surface;
  };
  if (!volume.surface.plan(body.mesh, boundary, {}, state, label, draft, planned.slots)) return {};
  delta = draft.delta();
  return planned;
}

}  // namespace

std::optional<EdgeCollapse> plan_collapse(const Volume& volume, const SharedBody& body, double ratio,
                                          CollapseSearch& search, TopologyDelta& delta) {
  TetTopology now = volume.topology;
  now.fetch_states_from([&](VertexId v) { return volume.state_of(body, v); });
  const auto label = [&](const Corners3& corners) {
    return static_cast<int>(body.mesh.triangle(volume.surface.triangle_of(body.mesh, corners)).surface);
  };
  const std::size_t count = volume.topology.vertex_count();
  const auto end = static_cast<VertexId>(std::min<std::size_t>(search.next + kVerticesAStep, count));
  std::optional<EdgeCollapse> planned;
  while (search.next < end && !planned) {
    const VertexId v = search.next++;
    if (volume.is_fixed_at(volume.topology.vertex(v).rest_body_m)) continue;
    if (const auto onto = collapse_onto(now, v, ratio, label)) planned = plan_one(volume, body, v, *onto, delta);
  }
  if (search.next == count) search.next = std::exchange(search.has_collapsed, false) ? 0 : kNone;
  return planned;
}

void collapse(Volume& volume, const SharedBody& body, const EdgeCollapse& planned) {
  std::vector<VertexId> around;
  for (const std::uint32_t t : volume.topology.star(planned.v))
    around.insert(around.end(), volume.topology.tetrahedra()[t].begin(), volume.topology.tetrahedra()[t].end());
  sort_unique(around);
  const Volume::Momentum before = volume.momentum(body, std::move(around));
  std::vector<VolumeDeformation::Slot> freed;
  for (const VertexId slot : planned.slots.freed) freed.push_back({slot, kNone});
  volume.deformation.change(body, volume.topology.collapse(planned.v, planned.onto), freed);
  volume.surface.accept(planned.slots);
  volume.conserve_momentum(body, before);
}

}  // namespace sectio
