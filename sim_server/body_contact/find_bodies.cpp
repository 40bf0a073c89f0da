#include "sim_server/body_contact/find_bodies.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

namespace sectio {
namespace {

constexpr double kTouching_m = 1e-6;  // closer points have no meaningful direction
constexpr double kOnEdge = 1e-6;      // barycentric coordinate
constexpr double kSameWay = 0.5;      // cosine between normals
// The surface that faces a point may be so many times as far as the closest one, which does not. Beyond that the match
// is wrong: a crumpled surface faces all ways.
constexpr double kFarther = 3;

// Cells of a grid over a box, marked where a surface may be near. A bowl's box holds all that lies in the bowl, most of
// which is far from its wall.
class NearCells {
 public:
  NearCells(const SurfaceView& surface, const Box3& box, double near_m)
      : box_(box),
        cell_m_(std::max(box.sizes().maxCoeff(), kTouching_m) / kCells),
        marked_(kCells * kCells * kCells, 0) {
    for (TriangleId t = 0; t < surface.mesh.triangle_slots(); ++t) {
      if (!surface.alive(t)) continue;
      const Box3 reached = grown(box_of(surface.corners(t)), near_m).intersection(box);
      if (!reached.isEmpty()) mark(cell_at(reached.min()), cell_at(reached.max()));
    }
  }
  std::vector<VertexId> vertices(const SurfaceView& surface) const {
    std::vector<VertexId> found;
    for (VertexId v = 0; v < surface.mesh.vertex_slots(); ++v) {
      if (!surface.mesh.vertex_alive(v)) continue;
      const Vec3 p = surface.positions_world_m[v].cast<double>();
      if (box_.contains(p) && marked_[number_of(cell_at(p))] != 0) found.push_back(v);
    }
    return found;
  }

 private:
  static constexpr int kCells = 32;  // along each side

  Eigen::Vector3i cell_at(const Vec3& p) const {
    return ((p - box_.min()) / cell_m_).cast<int>().cwiseMax(0).cwiseMin(kCells - 1);
  }
  static std::size_t number_of(const Eigen::Vector3i& cell) {
    const int number = (cell.z() * kCells + cell.y()) * kCells + cell.x();
    return static_cast<std::size_t>(number);
  }
  void mark(const Eigen::Vector3i& from, const Eigen::Vector3i& to) {
    for (int z = from.z(); z <= to.z(); ++z)
      for (int y = from.y(); y <= to.y(); ++y) {
        const auto row = marked_.begin() + static_cast<std::ptrdiff_t>(number_of({from.x(), y, z}));
        std::fill(row, row + (to.x() - from.x() + 1), std::uint8_t{1});
      }
  }

  Box3 box_;
  double cell_m_;
  std::vector<std::uint8_t> marked_;
};

std::vector<VertexId> vertices_near(const SurfaceView& surface, const SearchedSurface& other, const Box3& box,
                                    double near_m) {
  std::vector<VertexId> found;
  for (VertexId v = 0; v < surface.mesh.vertex_slots(); ++v)
    if (surface.mesh.vertex_alive(v) && box.contains(surface.positions_world_m[v].cast<double>())) found.push_back(v);
  if (found.size() <= kMaxProbedVertices) return found;
  Box3 of_found;
  for (const VertexId v : found) of_found.extend(surface.positions_world_m[v].cast<double>());
  return NearCells(other.view, of_found, near_m).vertices(surface);
}

// Surfaces that touch look against each other. A point that is beyond the middle of a thin body is nearer to its far
// side, which would draw it through.
bool looks_along(const SurfaceView& other, TriangleId t, const Vec3& normal) {
  return other.normal(t).dot(normal) > kSameWay;
}

std::optional<ClosestSurfacePoint> closest_against(const SearchedSurface& other, const Vec3& p, const Vec3& normal) {
  std::vector<TriangleId> near;
  const std::array<Vec3, 1> points{p};
  const std::array<std::array<std::size_t, 2>, 1> segments{{{0, 0}}};
  other.tree.near_segments(other.view, points, segments, kDeepestContact_m, near);
  std::optional<ClosestSurfacePoint> best;
  for (const TriangleId t : near) {
    if (looks_along(other.view, t, normal)) continue;
    const ClosestPoint c = closest_on_triangle(p, other.view.corners(t));
    const double distance_m = std::sqrt(c.squared_distance);
    if (distance_m <= kDeepestContact_m && (!best || distance_m < best->distance_m))
      best = ClosestSurfacePoint{t, c.bary, c.point, distance_m};
  }
  return best;
}

// A face of the skin that is closest, and not with an edge of it, says on which side of it the point is. Walls of a cut
// that has closed lie on each other. Counting the crossings of a ray takes twenty times as long.
bool is_inside(const SearchedSurface& other, const Vec3& p, const ClosestSurfacePoint& closest) {
  const double above_m = (p - closest.point_world_m).dot(other.view.normal(closest.triangle));
  const bool is_skin = other.view.mesh.triangle(closest.triangle).surface == Surface::skin;
  if (is_skin && closest.bary.minCoeff() > kOnEdge && std::abs(above_m) > kTouching_m) return above_m < 0;
  return other.tree.inside(other.view, p);
}

// Contacts of the vertices of `one`, whose normals point out of `other`.
void probe(const SurfaceView& one, const SearchedSurface& other, double reach_m, std::size_t most_probed,
           std::vector<BodyContact>& contacts) {
  Box3 box = other.tree.bounds_world_m();
  if (box.isEmpty()) return;
  box.min() -= Vec3::Constant(reach_m);
  box.max() += Vec3::Constant(reach_m);
  const std::vector<VertexId> near = vertices_near(one, other, box, std::max(reach_m, kDeepestContact_m));
  // Chosen by number, so that the same vertices are probed from step to step.
  const std::size_t stride = std::bit_ceil(near.size() / most_probed + 1);
  for (const VertexId v : near) {
    if (v % stride != 0) continue;
    const Vec3 p = one.positions_world_m[v].cast<double>();
    auto closest = other.tree.closest(other.view, p, std::max(reach_m, kDeepestContact_m));
    if (!closest) continue;
    const bool inside = is_inside(other, p, *closest);
    if (!inside && closest->distance_m > reach_m) continue;
    const Vec3 area = area_at(one, v), normal = area.stableNormalized();
    if (inside && looks_along(other.view, closest->triangle, normal))
      if (const auto against = closest_against(other, p, normal);
          against && against->distance_m < kFarther * closest->distance_m)
        closest = against;
    BodyContact contact;
    contact.point_world_m = p;
    contact.normal_world = other.view.normal(closest->triangle);
    if (closest->distance_m > kTouching_m)
      contact.normal_world = (inside ? 1 : -1) * (closest->point_world_m - p) / closest->distance_m;
    contact.area_m2 = static_cast<double>(stride) * area.norm() / 6;
    contact.depth_m = inside ? closest->distance_m : -closest->distance_m;
    contact.one = side_at(one.body, v);
    contact.other = {other.view.body, other.view.mesh.triangle(closest->triangle).v, closest->bary};
    contacts.push_back(contact);
  }
}

}  // namespace

Vec3 area_at(const SurfaceView& surface, VertexId v) {
  Vec3 sum = Vec3::Zero();
  for (const TriangleId t : surface.mesh.fan(v)) {
    const Corners c = surface.corners(t);
    sum += (c[1] - c[0]).cross(c[2] - c[0]);
  }
  return sum;
}

void find_body_contacts(const SearchedSurface& one, const SearchedSurface& other, double reach_m,
                        std::vector<BodyContact>& contacts, std::size_t most_probed) {
  probe(one.view, other, reach_m, most_probed, contacts);
  const std::size_t of_other = contacts.size();
  probe(other.view, one, reach_m, most_probed, contacts);
  for (std::size_t i = of_other; i < contacts.size(); ++i) {
    contacts[i].normal_world = -contacts[i].normal_world;
    std::swap(contacts[i].one, contacts[i].other);
  }
}

}  // namespace sectio
