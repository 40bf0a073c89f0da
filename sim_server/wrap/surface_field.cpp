#include "sim_server/wrap/surface_field.h"

#include <algorithm>
#include <cmath>

#include "common/math/solid_angle.h"

namespace sectio {
namespace {

using Corner3 = std::array<Vec3, 3>;

constexpr std::uint32_t kLeaf = 8;
constexpr double kFar = 2.3;  // radii of a node, from which it counts as a dipole: an error of some 1e-3

Vec3 middle_of(const Corner3& t) {
  return (t[0] + t[1] + t[2]) / 3;
}

// Ericson 2005, 5.1.5.
Vec3 closest_on(const Corner3& t, const Vec3& p) {
  const Vec3 &a = t[0], &b = t[1], &c = t[2];
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

}  // namespace

SurfaceField::SurfaceField(const TriangleSoup& soup) {
  for (const auto& t : soup.triangles)
    triangles_.push_back({soup.vertices_body_m[t[0]], soup.vertices_body_m[t[1]], soup.vertices_body_m[t[2]]});
  nodes_.reserve(triangles_.size());
  build(0, static_cast<std::uint32_t>(triangles_.size()));
}

std::uint32_t SurfaceField::build(std::uint32_t first, std::uint32_t count) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  double area = 0;
  const std::span<Corner3> mine(triangles_.data() + first, count);
  for (const Corner3& t : mine) {
    const Vec3 normal = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]);
    node.area_vector += normal;
    node.centre += normal.norm() * middle_of(t);
    area += normal.norm();
    for (const Vec3& p : t) node.box.extend(p);
  }
  node.centre = area > 0 ? Vec3(node.centre / area) : Vec3(node.box.center());
  for (const Corner3& t : mine)
    for (const Vec3& p : t) node.radius = std::max(node.radius, (p - node.centre).norm());
  if (count <= kLeaf) {
    node.first = first;
    node.count = count;
  } else {
    Eigen::Index axis = 0;
    node.box.sizes().maxCoeff(&axis);
    std::nth_element(mine.begin(), mine.begin() + count / 2, mine.end(),
                     [axis](const Corner3& a, const Corner3& b) { return middle_of(a)[axis] < middle_of(b)[axis]; });
    node.left = build(first, count / 2);
    node.right = build(first + count / 2, count - count / 2);
  }
  nodes_[index] = node;
  return index;
}

double SurfaceField::winding(std::uint32_t node, const Vec3& p) const {
  const Node& n = nodes_[node];
  const Vec3 d = n.centre - p;
  const double far2 = d.squaredNorm();
  if (far2 > kFar * kFar * n.radius * n.radius) return n.area_vector.dot(d) / (4 * M_PI * far2 * std::sqrt(far2));
  if (n.count == 0) return winding(n.left, p) + winding(n.right, p);
  double sum = 0;
  for (std::uint32_t t = n.first; t < n.first + n.count; ++t)
    sum += share_seen_from(p, triangles_[t][0], triangles_[t][1], triangles_[t][2]);
  return sum;
}

Vec3 SurfaceField::closest(const Vec3& p) const {
  double best2 = HUGE_VAL;
  Vec3 at = p;
  closest(0, p, best2, at);
  return at;
}

void SurfaceField::closest(std::uint32_t node, const Vec3& p, double& best2, Vec3& at) const {
  const Node& n = nodes_[node];
  for (std::uint32_t t = n.first; t < n.first + n.count; ++t) {
    const Vec3 q = closest_on(triangles_[t], p);
    if (const double d2 = (q - p).squaredNorm(); d2 < best2) best2 = d2, at = q;
  }
  if (n.count > 0) return;
  const double left2 = nodes_[n.left].box.squaredExteriorDistance(p);
  const double right2 = nodes_[n.right].box.squaredExteriorDistance(p);
  const bool left_first = left2 <= right2;
  if (std::min(left2, right2) < best2) closest(left_first ? n.left : n.right, p, best2, at);
  if (std::max(left2, right2) < best2) closest(left_first ? n.right : n.left, p, best2, at);
}

}  // namespace sectio
