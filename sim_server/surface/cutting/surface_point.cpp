#include "sim_server/surface/cutting/surface_point.h"

#include "common/math/intersect.h"

namespace sectio {

SurfacePoint nearest_on(const MeshDraft& draft, std::span<const TriangleId> triangles, const Vec3& point_world_m) {
  SurfacePoint nearest;
  double least = 1e300;
  for (const TriangleId t : triangles) {
    const auto& v = draft.triangle(t).v;
    const ClosestPoint c =
        closest_on_triangle(point_world_m, {draft.position(v[0]), draft.position(v[1]), draft.position(v[2])});
    if (c.squared_distance >= least) continue;
    least = c.squared_distance;
    nearest = {t, c.bary};
  }
  return nearest;
}

}  // namespace sectio
