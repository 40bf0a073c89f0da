#include "sim_server/bodies/touched_vertices.h"

#include <algorithm>

#include "common/core/sort_unique.h"

namespace sectio {

std::vector<VertexId> touched_vertices(const TopologyDelta& delta, const TriangleMesh& before) {
  std::vector<VertexId> touched;
  touched.reserve(delta.vertices.size() + 6 * delta.triangles.size());
  const auto add_corners = [&](const Triangle& triangle) {
    if (triangle.alive()) touched.insert(touched.end(), triangle.v.begin(), triangle.v.end());
  };
  for (const VertexEdit& edit : delta.vertices) touched.push_back(edit.id);
  for (const TriangleEdit& edit : delta.triangles) {
    if (edit.id < before.triangle_slots()) add_corners(before.triangle(edit.id));
    add_corners(edit.triangle);
  }
  sort_unique(touched);
  return touched;
}

}  // namespace sectio
