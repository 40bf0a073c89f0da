// A mesh with the state of its vertices, for tests of cutting without simulation: at rest unless a plan says otherwise.
#pragma once

#include <utility>
#include <vector>

#include "sim_server/cutting/mesh_draft.h"

namespace sectio::test {

class MeshAtRest {
 public:
  explicit MeshAtRest(const TriangleSoup& soup) : mesh(soup) { seed({}); }

  ParticleView view() const { return {positions.data(), velocities.data()}; }

  TriangleMesh mesh;
  std::vector<float> positions, velocities;  // four a vertex slot

 protected:
  // After a delta: new vertices are at rest, those named where their state says.
  void seed(const std::vector<std::pair<VertexId, VertexState>>& seeds) {
    const std::size_t known = positions.size() / 4;
    positions.resize(mesh.vertex_slots() * 4);
    velocities.resize(mesh.vertex_slots() * 4);
    for (std::size_t v = known; v < mesh.vertex_slots(); ++v) place(v, mesh.rest_body_m(static_cast<VertexId>(v)));
    for (const auto& [v, state] : seeds) place(v, state.position_world_m);
  }

 private:
  void place(std::size_t v, const Vec3& x) {
    for (int i = 0; i < 3; ++i) positions[4 * v + static_cast<std::size_t>(i)] = static_cast<float>(x[i]);
  }
};

}  // namespace sectio::test
