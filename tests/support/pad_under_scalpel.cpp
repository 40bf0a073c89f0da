#include "tests/support/pad_under_scalpel.h"

#include <algorithm>
#include <cmath>

namespace sectio::test {

Corners3 turned(Corners3 v) {
  std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
  return v;
}

Face PadUnderScalpel::face_of(const Vec3& x) {
  const double u = x.x() / kCell_m, w = x.y() / kCell_m;
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(w));
  return {i, j, w - j > u - i};
}

namespace {

bool is_skin_above(const TriangleMesh& mesh, const Triangle& t, double height_m) {
  return t.alive() && t.surface == Surface::skin &&
         std::ranges::all_of(t.v, [&](VertexId v) { return mesh.rest_body_m(v).z() > height_m - 1e-9; });
}

}  // namespace

bool PadUnderScalpel::on_top(const Triangle& t) const {
  return is_skin_above(mesh, t, kTop_m);
}

Entry entry_from_above(const TriangleMesh& mesh, const Vec3& p, std::uint32_t edge_id) {
  Entry best{edge_id, kNone, Vec3::Zero()};
  double best_least = -1e9;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    if (!is_skin_above(mesh, mesh.triangle(t), p.z())) continue;
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

void PadUnderScalpel::draw(const std::vector<std::array<double, 2>>& path, double depth_m) {
  enter_at(path[0][0], path[0][1]);
  for (const auto& [x, y] : path) {
    go(x, y, depth_m);
    expect_valid();
  }
  if (going()) lift();
  expect_valid();
}

std::map<Face, std::vector<Corners3>> PadUnderScalpel::skin() const {
  std::map<Face, std::vector<Corners3>> faces;
  for (const Triangle& t : mesh.triangles())
    if (on_top(t))
      faces[face_of((mesh.rest_body_m(t.v[0]) + mesh.rest_body_m(t.v[1]) + mesh.rest_body_m(t.v[2])) / 3)].push_back(
          turned(t.v));
  return faces;
}

std::set<Corners3> PadUnderScalpel::walls() const {
  std::set<Corners3> result;
  for (const Triangle& t : mesh.triangles())
    if (t.alive() && t.surface == Surface::wall) result.insert(turned(t.v));
  return result;
}

std::vector<VertexId> PadUnderScalpel::vertices_at(const Vec3& x) const {
  std::vector<VertexId> found;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    if (mesh.vertex_alive(v) && (mesh.rest_body_m(v) - x).norm() < 1e-6) found.push_back(v);
  return found;
}

VertexId PadUnderScalpel::only_vertex_at(const Vec3& x) const {
  const auto found = vertices_at(x);
  EXPECT_EQ(found.size(), 1u) << "at " << x.transpose();
  return found.size() == 1 ? found[0] : kNone;
}

}  // namespace sectio::test
