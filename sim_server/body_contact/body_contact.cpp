#include "sim_server/body_contact/body_contact.h"

#include <bit>

namespace sectio {
namespace {

constexpr double kTouchingM = 1e-6;  // closer points have no meaningful direction

Vec3 normal_of(const Corners& c) {
  return (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized();
}

}  // namespace

void find_contacts(const SurfaceView& one, const SurfaceView& other, const CollisionEngine& tree_of_other,
                   double reach_m, std::vector<BodyContact>& contacts) {
  Box3 box = tree_of_other.bounds_world_m();
  if (box.isEmpty()) return;
  box.min() -= Vec3::Constant(reach_m);
  box.max() += Vec3::Constant(reach_m);
  std::vector<VertexId> near;
  for (VertexId v = 0; v < one.mesh.vertex_slots(); ++v)
    if (one.mesh.vertex_alive(v) && box.contains(one.positions_world_m[v].cast<double>())) near.push_back(v);
  // Chosen by number, so that the same vertices are probed from step to step.
  const std::size_t stride = std::bit_ceil(near.size() / kMaxProbedVertices + 1);
  for (const VertexId v : near) {
    if (v % stride != 0) continue;
    const Vec3 p = one.positions_world_m[v].cast<double>();
    const auto closest = tree_of_other.closest(other, p, std::max(reach_m, kDeepestContactM));
    if (!closest) continue;
    const bool inside = tree_of_other.inside(other, p);
    if (!inside && closest->distance_m > reach_m) continue;
    BodyContact contact{v, p, normal_of(other.corners(closest->triangle)), 0, closest->triangle, closest->bary};
    if (closest->distance_m > kTouchingM)
      contact.normal_world = (inside ? 1 : -1) * (closest->point_world_m - p) / closest->distance_m;
    contact.depth_m = inside ? closest->distance_m : -closest->distance_m;
    contacts.push_back(contact);
  }
}

}  // namespace sectio
