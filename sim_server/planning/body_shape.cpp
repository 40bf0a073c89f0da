#include "sim_server/planning/body_shape.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/intersect.h"

namespace sectio::planning {
namespace {

constexpr std::size_t kSamples = 300;  // triangles whose depth is measured
constexpr double kBoxShare = 0.999;    // a box has this share of its area on its bounding box
constexpr double kSharp = 0.5;         // least length of sharp edges times thickness over area; a long square bar has 1

Corners corners(const TriangleSoup& surface, std::size_t t) {
  const auto& v = surface.triangles[t];
  return {surface.vertices_body_m[v[0]], surface.vertices_body_m[v[1]], surface.vertices_body_m[v[2]]};
}

Vec3 area_normal(const Corners& c) {
  return 0.5 * (c[1] - c[0]).cross(c[2] - c[0]);
}

// False if the line certainly misses a triangle. `direction`: unit.
bool may_cross(const Vec3& origin, const Vec3& direction, const Corners& c) {
  constexpr double kMargin = 1 + 1e-6;
  const Vec3 from = c[0] - origin;
  const double beside = from.squaredNorm() - std::pow(from.dot(direction), 2);
  return beside <= kMargin * std::max((c[1] - c[0]).squaredNorm(), (c[2] - c[0]).squaredNorm()) +
                       (kMargin - 1) * from.squaredNorm();
}

// The depth of tissue beneath the middle of a triangle.
double depth_beneath_m(const TriangleSoup& surface, std::size_t t) {
  const Corners c = corners(surface, t);
  const Vec3 inwards = -area_normal(c).normalized(), from = (c[0] + c[1] + c[2]) / 3;
  double nearest = HUGE_VAL;
  for (std::size_t k = 0; k < surface.triangles.size(); ++k) {
    if (k == t) continue;
    const Corners other = corners(surface, k);
    if (!may_cross(from, inwards, other)) continue;
    const auto hit = cross_ray(from, inwards, other);
    if (hit && hit->parameter > 1e-9) nearest = std::min(nearest, hit->parameter);
  }
  return nearest;
}

double on_its_box(const TriangleSoup& surface, const Eigen::AlignedBox3d& box) {
  const double near = 1e-6 * box.diagonal().norm();
  double on = 0, all = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Corners c = corners(surface, t);
    const double area = area_normal(c).norm();
    all += area;
    for (int k = 0; k < 3; ++k)
      for (const double side : {box.min()[k], box.max()[k]})
        if (std::ranges::all_of(c, [&](const Vec3& p) { return std::abs(p[k] - side) < near; })) on += area;
  }
  return on / all;
}

// The length of edges between faces more than 45 degrees apart.
double sharp_length_m(const TriangleSoup& surface) {
  std::map<std::pair<VertexId, VertexId>, Vec3> normal_at;  // normal of the first of an edge's two faces
  double sum = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3 normal = area_normal(corners(surface, t)).normalized();
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
  std::vector<std::pair<double, double>> depths;  // with the area of the triangle
  const std::size_t every = std::max<std::size_t>(1, surface.triangles.size() / kSamples);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Corners c = corners(surface, t);
    const double triangle_m2 = area_normal(c).norm();
    shape.volume_m3 += c[0].dot(c[1].cross(c[2])) / 6;
    area_m2 += triangle_m2;
    edges += ((c[1] - c[0]).norm() + (c[2] - c[1]).norm() + (c[0] - c[2]).norm()) / 3;
    if (t % every != 0) continue;
    const double depth = depth_beneath_m(surface, t);
    if (std::isfinite(depth)) depths.emplace_back(depth, triangle_m2);
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
  const Vec3 unit = direction.normalized();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Corners other = corners(surface, t);
    if (!may_cross(origin, unit, other)) continue;
    const auto hit = cross_ray(origin, direction, other);
    if (!hit) continue;
    if (!found) found = Chord{hit->parameter, hit->parameter};
    found->enters = std::min(found->enters, hit->parameter);
    found->leaves = std::max(found->leaves, hit->parameter);
  }
  return found;
}

}  // namespace sectio::planning
