// A flat pad at rest, 60 x 40 x 20 mm in cells of 10 mm, and a scalpel upright on its upper side: every subdivision
// can be read off in two coordinates. A cell's diagonal goes from its lower left to its upper right corner.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "tests/support/scalpel_on_mesh.h"
#include "tests/support/shapes.h"

namespace sectio::test {

// An original triangle of the upper side: column, row, above the diagonal.
using Face = std::tuple<int, int, bool>;
using Corners3 = std::array<VertexId, 3>;

// Turned so that the lowest vertex comes first; the cyclic order stays.
inline Corners3 turned(Corners3 v) {
  std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
  return v;
}

class PadUnderScalpel : public ScalpelOnMesh {
 public:
  static constexpr double kTop_m = 0.02, kCell_m = 0.01;

  explicit PadUnderScalpel(StrokeSettings s = {}) : ScalpelOnMesh(box(6, 4, 2, Vec3(0.06, 0.04, kTop_m)), s) {}

  static Vec3 top(double x_m, double y_m) { return {x_m, y_m, kTop_m}; }
  static Face face_of(const Vec3& x) {
    const double u = x.x() / kCell_m, w = x.y() / kCell_m;
    const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(w));
    return {i, j, w - j > u - i};
  }

  bool on_top(const Triangle& t) const {
    return t.alive() && t.surface == Surface::skin &&
           std::all_of(t.v.begin(), t.v.end(), [&](VertexId v) { return mesh.rest_body_m(v).z() > kTop_m - 1e-9; });
  }
  // The triangle under a point of the upper side, and where in it.
  Entry entry_at(double x_m, double y_m, std::uint32_t tool_id = 0) const {
    const Vec3 p = top(x_m, y_m);
    Entry best{tool_id, kNone, Vec3::Zero()};
    double best_least = -1e9;
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
      if (!on_top(mesh.triangle(t))) continue;
      const auto& v = mesh.triangle(t).v;
      const Vec3 a = mesh.rest_body_m(v[0]), b = mesh.rest_body_m(v[1]), c = mesh.rest_body_m(v[2]);
      const double area = (b - a).cross(c - a).z();
      if (area < 1e-12) continue;
      Vec3 bary((b - p).cross(c - p).z() / area, (c - p).cross(a - p).z() / area, 0);
      bary[2] = 1 - bary[0] - bary[1];
      if (bary.minCoeff() > best_least) best_least = bary.minCoeff(), best.triangle = t, best.bary = bary;
    }
    best.bary = best.bary.cwiseMax(0.0) / best.bary.cwiseMax(0.0).sum();
    return best;
  }
  void enter_at(double x_m, double y_m, std::uint32_t tool_id = 0) { entries.push_back(entry_at(x_m, y_m, tool_id)); }
  CutPlan go(double x_m, double y_m, double depth_m = 0.004) { return to(top(x_m, y_m), Vec3::UnitZ(), depth_m); }

  // In over the first point, along the others, out; every step leaves a valid surface.
  void draw(const std::vector<std::array<double, 2>>& path, double depth_m = 0.004) {
    enter_at(path[0][0], path[0][1]);
    for (const auto& [x, y] : path) {
      go(x, y, depth_m);
      expect_valid();
    }
    if (going()) lift();
    expect_valid();
  }

  // What became of the original triangles of the upper side.
  std::map<Face, std::vector<Corners3>> skin() const {
    std::map<Face, std::vector<Corners3>> faces;
    for (const Triangle& t : mesh.triangles())
      if (on_top(t))
        faces[face_of((mesh.rest_body_m(t.v[0]) + mesh.rest_body_m(t.v[1]) + mesh.rest_body_m(t.v[2])) / 3)].push_back(
            turned(t.v));
    return faces;
  }
  std::set<Corners3> walls() const {
    std::set<Corners3> result;
    for (const Triangle& t : mesh.triangles())
      if (t.alive() && t.surface == Surface::wall) result.insert(turned(t.v));
    return result;
  }
  // Live vertices at a rest position, to a micrometre.
  std::vector<VertexId> vertices_at(const Vec3& x) const {
    std::vector<VertexId> found;
    for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
      if (mesh.vertex_alive(v) && (mesh.rest_body_m(v) - x).norm() < 1e-6) found.push_back(v);
    return found;
  }
  VertexId only_vertex_at(const Vec3& x) const {
    const auto found = vertices_at(x);
    EXPECT_EQ(found.size(), 1u) << "at " << x.transpose();
    return found.size() == 1 ? found[0] : kNone;
  }
};

}  // namespace sectio::test
