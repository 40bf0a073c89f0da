// The bodies that random strokes are drawn on, and how many: one list for both styles of cutting.
#pragma once

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/delta/topology_delta.h"
#include "tests/support/shapes.h"

namespace sectio::test {

struct StrokeShape {
  std::string name;
  TriangleSoup soup;
  double step_m = 0;  // of the instrument
};

inline std::vector<StrokeShape> stroke_shapes() {
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

// 7 shapes x 8 seeds x (90 + 90) strokes: over ten thousand in both styles. A sanitizer makes each of them ten times as
// slow, so that there every tenth is drawn.
#ifdef SECTIO_SANITIZED
constexpr int kSampled = 10;
#else
constexpr int kSampled = 1;
#endif
constexpr std::uint64_t kStrokeSeeds = 8;
constexpr int kStrokesPerSeed = 90 / kSampled;

inline std::string name_of(const testing::TestParamInfo<StrokeShape>& shape) {
  return shape.param.name;
}

// The volume that one delta takes away, from its own triangles alone: those at which a corner or a place has changed,
// before and after, seen from one of their vertices. It is right only if both close the same hole.
class VolumeAccount {
 public:
  explicit VolumeAccount(const TriangleMesh& mesh) : before_(mesh) {}

  void add(const TopologyDelta& delta, const TriangleMesh& after) {
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
  double removed_m3() const { return removed_m3_; }

 private:
  double volume(const TriangleMesh& mesh, const std::set<TriangleId>& triangles) const {
    double sum = 0;
    for (const TriangleId t : triangles) {
      if (t >= mesh.triangle_slots() || !mesh.triangle(t).alive()) continue;
      const auto& v = mesh.triangle(t).v;
      sum += mesh.rest_body_m(v[0]).dot(mesh.rest_body_m(v[1]).cross(mesh.rest_body_m(v[2]))) / 6;
    }
    return sum;
  }

  TriangleMesh before_;
  double removed_m3_ = 0;
};

}  // namespace sectio::test
