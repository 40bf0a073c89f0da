// A point of a surface, in the barycentric coordinates of a triangle.
#pragma once

#include <span>

#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio {

struct SurfacePoint {
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Zero();
};
// The point of the given triangles that is nearest to a point; kNone if there are no triangles.
SurfacePoint nearest_on(const MeshDraft& draft, std::span<const TriangleId> triangles, const Vec3& point_world_m);

}  // namespace sectio
