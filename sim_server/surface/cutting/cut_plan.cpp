#include "sim_server/surface/cutting/cut_plan.h"

#include <algorithm>

namespace sectio {

const BladeMotion* motion_of(std::span<const BladeMotion> motions, std::uint32_t edge_id) {
  const auto it = std::ranges::find(motions, edge_id, &BladeMotion::edge_id);
  return it != motions.end() ? &*it : nullptr;
}

bool all_wait(std::span<const Entry> entries, std::span<const BladeMotion> motions) {
  return entries.empty() &&
         std::ranges::all_of(motions, [](const BladeMotion& m) { return m.path.empty() && !m.lift; });
}

std::vector<VertexId> gone_with(const TopologyDelta& delta, const TriangleMesh& mesh) {
  std::vector<VertexId> gone;
  for (const VertexEdit& e : delta.vertices)
    if (e.id >= mesh.vertex_slots() || !mesh.vertex_alive(e.id)) gone.push_back(e.id);
  return gone;
}

}  // namespace sectio
