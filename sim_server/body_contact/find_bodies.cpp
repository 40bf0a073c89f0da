#include "sim_server/body_contact/find_bodies.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

namespace sectio {
namespace {

constexpr double kTouching_m = 1e-6;  // closer points have no meaningful direction
constexpr double kSameWay = 0.5;      // cosine between normals

std::vector<VertexId> vertices_in(const SurfaceView& surface, const Box3& box) {
  std::vector<VertexId> found;
  for (VertexId v = 0; v < surface.mesh.vertex_slots(); ++v)
    if (surface.mesh.vertex_alive(v) && box.contains(surface.positions_world_m[v].cast<double>())) found.push_back(v);
  return found;
}

// Surfaces that touch look against each other. A point that is beyond the middle of a thin body is nearer to its far
// side, which would draw it through.
bool looks_along(const SurfaceView& other, TriangleId t, const Vec3& normal) {
  return other.normal(t).dot(normal) > kSameWay;
}

// Its length is the area of the triangles around the vertex, twice.
Vec3 area_at(const SurfaceView& surface, VertexId v) {
  Vec3 sum = Vec3::Zero();
  for (const TriangleId t : surface.mesh.fan(v)) {
    const Corners c = surface.corners(t);
    sum += (c[1] - c[0]).cross(c[2] - c[0]);
  }
  return sum;
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

// Contacts of the vertices of `one`, whose normals point out of `other`.
void probe(const SurfaceView& one, const SearchedSurface& other, double reach_m, std::vector<BodyContact>& contacts) {
  Box3 box = other.tree.bounds_world_m();
  if (box.isEmpty()) return;
  box.min() -= Vec3::Constant(reach_m);
  box.max() += Vec3::Constant(reach_m);
  const std::vector<VertexId> near = vertices_in(one, box);
  // Chosen by number, so that the same vertices are probed from step to step.
  const std::size_t stride = std::bit_ceil(near.size() / kMaxProbedVertices + 1);
  for (const VertexId v : near) {
    if (v % stride != 0) continue;
    const Vec3 p = one.positions_world_m[v].cast<double>();
    auto closest = other.tree.closest(other.view, p, std::max(reach_m, kDeepestContact_m));
    if (!closest) continue;
    const bool inside = other.tree.inside(other.view, p);
    if (!inside && closest->distance_m > reach_m) continue;
    const Vec3 area = area_at(one, v), normal = area.stableNormalized();
    if (inside && looks_along(other.view, closest->triangle, normal))
      if (const auto against = closest_against(other, p, normal)) closest = against;
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

void find_body_contacts(const SearchedSurface& one, const SearchedSurface& other, double reach_m,
                        std::vector<BodyContact>& contacts) {
  probe(one.view, other, reach_m, contacts);
  const std::size_t of_other = contacts.size();
  probe(other.view, one, reach_m, contacts);
  for (std::size_t i = of_other; i < contacts.size(); ++i) {
    contacts[i].normal_world = -contacts[i].normal_world;
    std::swap(contacts[i].one, contacts[i].other);
  }
}

}  // namespace sectio
