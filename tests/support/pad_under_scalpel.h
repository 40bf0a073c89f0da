// A flat pad at rest, 60 x 40 x 20 mm in cells of 10 mm, and a scalpel upright on its upper side: every subdivision
// can be read off in two coordinates. A cell's diagonal goes from its lower left to its upper right corner.
#pragma once

#include <array>
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
Corners3 turned(Corners3 v);

// The triangle of the skin under a point of a flat upper side, and the place of the point in it.
Entry entry_from_above(const TriangleMesh& mesh, const Vec3& top, std::uint32_t edge_id = 0);

class PadUnderScalpel : public ScalpelOnMesh {
 public:
  static constexpr double kTop_m = 0.02, kCell_m = 0.01;

  explicit PadUnderScalpel(StrokeSettings s = {}) : ScalpelOnMesh(box(6, 4, 2, Vec3(0.06, 0.04, kTop_m)), s) {}

  static Vec3 top(double x_m, double y_m) { return {x_m, y_m, kTop_m}; }
  static Face face_of(const Vec3& x);

  bool on_top(const Triangle& t) const;
  Entry entry_at(double x_m, double y_m, std::uint32_t edge_id = 0) const {
    return entry_from_above(mesh, top(x_m, y_m), edge_id);
  }
  void enter_at(double x_m, double y_m, std::uint32_t edge_id = 0) { entries.push_back(entry_at(x_m, y_m, edge_id)); }
  CutPlan go(double x_m, double y_m, double depth_m = 0.004) { return to(top(x_m, y_m), Vec3::UnitZ(), depth_m); }

  // In over the first point, along the others, out; every step leaves a valid surface.
  void draw(const std::vector<std::array<double, 2>>& path, double depth_m = 0.004);

  // The subdivision of the original triangles of the upper side.
  std::map<Face, std::vector<Corners3>> skin() const;
  std::set<Corners3> walls() const;
  // Live vertices at a rest position, to a micrometre.
  std::vector<VertexId> vertices_at(const Vec3& x) const;
  VertexId only_vertex_at(const Vec3& x) const;
};

}  // namespace sectio::test
