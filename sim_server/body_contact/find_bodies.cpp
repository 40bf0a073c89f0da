#include "sim_server/body_contact/find_bodies.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace sectio {
namespace {

constexpr double kTouching_m = 1e-6;  // closer points have no meaningful direction

std::vector<VertexId> vertices_in(const SurfaceView& surface, const Box3& box) {
  std::vector<VertexId> found;
  for (VertexId v = 0; v < surface.mesh.vertex_slots(); ++v)
    if (surface.mesh.vertex_alive(v) && box.contains(surface.positions_world_m[v].cast<double>())) found.push_back(v);
  return found;
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
    const auto closest = other.tree.closest(other.view, p, std::max(reach_m, kDeepestContact_m));
    if (!closest) continue;
    const bool inside = other.tree.inside(other.view, p);
    if (!inside && closest->distance_m > reach_m) continue;
    BodyContact contact;
    contact.point_world_m = p;
    contact.normal_world = other.view.normal(closest->triangle);
    if (closest->distance_m > kTouching_m)
      contact.normal_world = (inside ? 1 : -1) * (closest->point_world_m - p) / closest->distance_m;
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
