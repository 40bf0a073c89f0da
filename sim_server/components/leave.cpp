#include "sim_server/components/leave.h"

#include <algorithm>

namespace sectio {

Leaving leave(const TriangleMesh& mesh, const Part& part) {
  Leaving result;
  TopologyDelta& d = result.delta;
  d.base_revision = mesh.revision();
  d.revision = d.base_revision + 1;
  d.vertex_slots_after = mesh.vertex_slots();
  d.triangle_slots_after = mesh.triangle_slots();
  d.hash_after = mesh.hash();
  std::vector<Vec3> rest_body_m;
  for (const VertexId v : part.vertices) {
    d.vertices.push_back({v, false, Vec3::Zero()});
    d.hash_after -= vertex_hash(v, mesh.rest_body_m(v));
    rest_body_m.push_back(mesh.rest_body_m(v));
  }
  std::vector<Triangle> triangles;
  for (const TriangleId t : part.triangles) {
    Triangle content = mesh.triangle(t);
    d.triangles.push_back({t, Triangle{}});
    d.hash_after -= triangle_hash(t, content);
    for (VertexId& v : content.v)
      v = static_cast<VertexId>(std::lower_bound(part.vertices.begin(), part.vertices.end(), v) -
                                part.vertices.begin());
    triangles.push_back(content);
  }
  std::vector<std::uint8_t> alive(rest_body_m.size(), 1);
  result.mesh = TriangleMesh(std::move(rest_body_m), std::move(alive), std::move(triangles), 0);
  result.vertex_from = part.vertices;
  return result;
}

}  // namespace sectio
