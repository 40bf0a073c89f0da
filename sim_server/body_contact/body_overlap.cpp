#include "sim_server/body_contact/body_overlap.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "common/mesh/check.h"

namespace sectio {
namespace {

constexpr double kLongestWay_m = 0.03;  // through the vertex's own body
constexpr double kOffSurface_m = 1e-5;  // the way begins beneath the vertex's own triangles
constexpr double kAcross = 0.5;         // cosine
constexpr double kThinnest_m = 1e-3;    // a body's edge that dents another one is thinner
constexpr double kSearchedAround_m = 0.03;
constexpr double kFar = 20;               // metres
const Vec3 kAside(0.011, 0.017, -0.013);  // a way along an edge of the mesh would cross nothing for certain

// When surfaces only touch, neither body contains a part of the other. A vertex has come through when, on the straight
// way into its own body, the other body begins and ends, both times across the way, and is not just a sliver between.
// The end is how deep the vertex is; 0: it has not come through.
double came_through_m(const SearchedSurface& one, const SearchedSurface& other, VertexId v) {
  const Vec3 p = one.view.positions_world_m[v].cast<double>(), normal = area_at(one.view, v).stableNormalized();
  if (normal.isZero(0) || other.tree.inside(other.view, p)) return 0;
  const Vec3 from = p - kOffSurface_m * normal, way_m = -kLongestWay_m * (normal + kAside);
  const auto hits = other.tree.hits(other.view, from, from + way_m);
  if (hits.size() < 2) return 0;
  const SurfaceHit &begins = hits[0], &ends = hits[1];
  const Vec3 along = way_m.normalized();
  if (-begins.normal_world.dot(along) < kAcross || ends.normal_world.dot(along) < kAcross) return 0;
  if (const auto leaves = one.tree.first_hit(one.view, from, from + way_m);
      leaves && leaves->parameter < ends.parameter)
    return 0;
  const Vec3 middle = (begins.point_world_m + ends.point_world_m) / 2;
  if (other.tree.closest(other.view, middle, kThinnest_m / 2) || !one.tree.inside(one.view, middle)) return 0;
  return ends.parameter * way_m.norm();
}

void look_through(const SearchedSurface& one, const SearchedSurface& other, Overlap& overlap) {
  const Box3 around = other.tree.bounds_world_m();
  if (around.isEmpty()) return;
  const Box3 box = grown(around, kSearchedAround_m);
  for (VertexId v = 0; v < one.view.mesh.vertex_slots(); ++v) {
    if (!one.view.mesh.vertex_alive(v) || !box.contains(one.view.positions_world_m[v].cast<double>())) continue;
    const double depth_m = came_through_m(one, other, v);
    overlap.come_through += depth_m > 0;
    overlap.deepest_m = std::max(overlap.deepest_m, depth_m);
  }
}

// A triangle about a vertex that has skin all around; kNone: it has walls, too.
TriangleId skin_at(const TriangleMesh& mesh, VertexId v) {
  TriangleId skin = kNone;
  for (const TriangleId t : mesh.fan(v)) {
    if (mesh.triangle(t).surface != Surface::skin) return kNone;
    skin = t;
  }
  return skin;
}

}  // namespace

// A part that lies on another one touches it; one that has sunk in has the other's tissue on both sides of its skin. A
// ray that crosses the surfaces of others an odd number of times begins in one of them.
std::size_t sunken_skin(const SearchedSurface& body) {
  const TriangleMesh& mesh = body.view.mesh;
  const std::vector<std::uint32_t> component = component_of_triangle(mesh);
  const std::vector<double> volumes_m3 = component_rest_volumes_m3(mesh, component);
  if (volumes_m3.size() < 2) return 0;
  const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(volumes_m3) - volumes_m3.begin());
  std::size_t sunken = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    const TriangleId skin = mesh.vertex_alive(v) ? skin_at(mesh, v) : kNone;
    if (skin == kNone || component[skin] == largest) continue;
    const std::uint32_t own = component[skin];
    if (volumes_m3[own] <= 0) continue;  // the wall of a cavity
    const Vec3 normal = area_at(body.view, v).stableNormalized();
    const Vec3 above = body.view.positions_world_m[v].cast<double>() + kOffSurface_m * normal;
    const auto of_others = [&](const Vec3& to) {
      return std::ranges::count_if(body.tree.hits(body.view, above, to),
                                   [&](const SurfaceHit& hit) { return component[hit.triangle] != own; });
    };
    sunken += of_others(above + kFar * (normal + kAside)) % 2 == 1 && of_others(above - kThinnest_m * normal) == 0;
  }
  return sunken;
}

Overlap overlap_of(const SearchedSurface& one, const SearchedSurface& other) {
  Overlap overlap;
  std::vector<BodyContact> contacts;
  find_body_contacts(one, other, 0, contacts, std::numeric_limits<std::size_t>::max() / 4);
  for (const BodyContact& c : contacts) overlap.deepest_m = std::max(overlap.deepest_m, c.depth_m);
  look_through(one, other, overlap);
  look_through(other, one, overlap);
  return overlap;
}

}  // namespace sectio
