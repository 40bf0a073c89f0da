// A mesh with the state of its vertices, for tests of cutting without simulation: at rest unless a plan says otherwise.
#pragma once

#include <utility>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio::test {

class MeshAtRest {
 public:
  explicit MeshAtRest(const TriangleSoup& soup) : mesh(soup), particles(particles_at_rest(mesh.rest_body_m(), {})) {}

  ParticleView view() const { return particles.view(); }

  TriangleMesh mesh;
  ParticleState particles;

 protected:
  // After a delta: new vertices are at rest, seeded ones where their state says.
  void seed(const std::vector<std::pair<VertexId, VertexState>>& seeds) {
    const std::size_t known = particles.size();
    particles.resize(mesh.vertex_slots());
    for (std::size_t v = known; v < particles.size(); ++v) particles.place(v, mesh.rest_body_m()[v]);
    for (const auto& [v, state] : seeds) particles.place(v, state.position_world_m);
  }
};

}  // namespace sectio::test
