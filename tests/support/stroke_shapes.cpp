#include "tests/support/stroke_shapes.h"

#include <utility>

namespace sectio::test {

std::vector<StrokeShape> stroke_shapes() {
  return {{"ball", ellipsoid(2, Vec3::Constant(0.05)), 0.012},
          {"ball_with_small_steps", ellipsoid(2, Vec3::Constant(0.05)), 0.003},
          {"box_with_sharp_edges", box(4, 3, 2, Vec3(0.08, 0.06, 0.04)), 0.012},
          {"flat_lens", ellipsoid(2, Vec3(0.05, 0.05, 0.004)), 0.01},
          {"torus", torus(16, 8, 0.05, 0.02), 0.01},
          {"slivers", ellipsoid(2, Vec3(0.2, 0.01, 0.01)), 0.004},
          {"one_tetrahedron",
           {{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}},
           0.01}};
}

std::string name_of(const testing::TestParamInfo<StrokeShape>& shape) {
  return shape.param.name;
}

void VolumeAccount::add(const TopologyDelta& delta, const TriangleMesh& after) {
  std::set<TriangleId> changed;
  for (const TriangleEdit& e : delta.triangles) changed.insert(e.id);
  std::set<VertexId> moved;
  for (const VertexEdit& e : delta.vertices) moved.insert(e.id);
  for (const TriangleMesh* mesh : {&std::as_const(before_), &after})
    for (TriangleId t = 0; t < mesh->triangle_slots(); ++t)
      for (const VertexId v : mesh->triangle(t).v)
        if (mesh->triangle(t).alive() && moved.contains(v)) changed.insert(t);
  if (!delta.vertices.empty() || !delta.triangles.empty())
    removed_m3_ += volume(before_, changed) - volume(after, changed);
  before_ = after;
}

double VolumeAccount::volume(const TriangleMesh& mesh, const std::set<TriangleId>& triangles) const {
  double sum = 0;
  for (const TriangleId t : triangles) {
    if (t >= mesh.triangle_slots() || !mesh.triangle(t).alive()) continue;
    const auto& v = mesh.triangle(t).v;
    sum += mesh.rest_body_m(v[0]).dot(mesh.rest_body_m(v[1]).cross(mesh.rest_body_m(v[2]))) / 6;
  }
  return sum;
}

}  // namespace sectio::test
