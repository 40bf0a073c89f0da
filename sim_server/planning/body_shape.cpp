#include "sim_server/planning/body_shape.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace sectio::planning {
namespace {

constexpr std::size_t kSamples = 300;  // of the surface
constexpr double kBoxShare = 0.999;    // of its area that lies on the box around it
constexpr double kSharp = 0.5;         // a long square bar has 1
constexpr double kOnCells = 0.01;      // of a cell

struct Face {
  Vec3 a, b, c;
  Vec3 area_normal() const { return 0.5 * (b - a).cross(c - a); }
};

Face face(const TriangleSoup& surface, std::size_t t) {
  const auto& v = surface.triangles[t];
  return {surface.vertices_body_m[v[0]], surface.vertices_body_m[v[1]], surface.vertices_body_m[v[2]]};
}

// Along the ray, in lengths of direction; nothing: beside the face.
std::optional<double> hit(const Face& f, const Vec3& origin, const Vec3& direction) {
  const Vec3 u = f.b - f.a, w = f.c - f.a, p = direction.cross(w);
  const double det = u.dot(p);
  if (det == 0) return std::nullopt;
  const Vec3 s = origin - f.a;
  const double x = s.dot(p) / det;
  if (x < 0 || x > 1) return std::nullopt;
  const Vec3 q = s.cross(u);
  const double y = direction.dot(q) / det;
  if (y < 0 || x + y > 1) return std::nullopt;
  return w.dot(q) / det;
}

// Tissue beneath the middle of a triangle.
double depth_beneath_m(const TriangleSoup& surface, std::size_t t) {
  const Face f = face(surface, t);
  const Vec3 inwards = -f.area_normal().normalized(), from = (f.a + f.b + f.c) / 3;
  double nearest = HUGE_VAL;
  for (std::size_t k = 0; k < surface.triangles.size(); ++k) {
    if (k == t) continue;
    const auto at = hit(face(surface, k), from, inwards);
    if (at && *at > 1e-9) nearest = std::min(nearest, *at);
  }
  return nearest;
}

double on_its_box(const TriangleSoup& surface, const Eigen::AlignedBox3d& box) {
  const double near = 1e-6 * box.diagonal().norm();
  double on = 0, all = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Face f = face(surface, t);
    const double area = f.area_normal().norm();
    all += area;
    for (int k = 0; k < 3; ++k)
      for (const double side : {box.min()[k], box.max()[k]})
        if (std::abs(f.a[k] - side) < near && std::abs(f.b[k] - side) < near && std::abs(f.c[k] - side) < near)
          on += area;
  }
  return on / all;
}

// Of edges between faces more than 45 degrees apart.
double sharp_length_m(const TriangleSoup& surface) {
  std::map<std::pair<VertexId, VertexId>, Vec3> normal_at;  // of the first of an edge's two faces
  double sum = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3 normal = face(surface, t).area_normal().normalized();
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId a = surface.triangles[t][i], b = surface.triangles[t][(i + 1) % 3];
      const auto [at, is_new] = normal_at.try_emplace(std::minmax(a, b), normal);
      if (!is_new && normal.dot(at->second) < std::sqrt(0.5))
        sum += (surface.vertices_body_m[a] - surface.vertices_body_m[b]).norm();
    }
  }
  return sum;
}

}  // namespace

BodyShape shape_of(const TriangleSoup& surface) {
  BodyShape shape;
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices_body_m) box.extend(p);
  shape.size_m = box.sizes();
  shape.vertices = surface.vertices_body_m.size();
  shape.is_box = on_its_box(surface, box) > kBoxShare;
  double edges = 0, area_m2 = 0;
  std::vector<std::pair<double, double>> depths;  // with the area that has it
  const std::size_t every = std::max<std::size_t>(1, surface.triangles.size() / kSamples);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Face f = face(surface, t);
    shape.volume_m3 += f.a.dot(f.b.cross(f.c)) / 6;
    area_m2 += f.area_normal().norm();
    edges += ((f.b - f.a).norm() + (f.c - f.b).norm() + (f.a - f.c).norm()) / 3;
    if (t % every != 0) continue;
    const double depth = depth_beneath_m(surface, t);
    if (std::isfinite(depth)) depths.emplace_back(depth, f.area_normal().norm());
  }
  shape.edge_m = edges / static_cast<double>(surface.triangles.size());
  std::sort(depths.begin(), depths.end());
  double half = 0;
  for (const auto& [depth, area] : depths) half += 0.5 * area;
  shape.thickness_m = shape.size_m.minCoeff();
  for (const auto& [depth, area] : depths)
    if ((half -= area) <= 0) {
      shape.thickness_m = depth;
      break;
    }
  shape.sharp_edges = sharp_length_m(surface) * shape.thickness_m > kSharp * area_m2;
  return shape;
}

bool lies_on_cells(const BodyShape& shape, double cell_m) {
  if (!shape.is_box) return false;
  const double cells = shape.size_m.minCoeff() / cell_m;
  return std::abs(cells - std::round(cells)) < kOnCells;
}

std::optional<Chord> chord(const TriangleSoup& surface, const Vec3& origin, const Vec3& direction) {
  std::optional<Chord> found;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto at = hit(face(surface, t), origin, direction);
    if (!at || *at < 0) continue;
    if (!found) found = Chord{*at, *at};
    found->enters = std::min(found->enters, *at);
    found->leaves = std::max(found->leaves, *at);
  }
  return found;
}

}  // namespace sectio::planning
