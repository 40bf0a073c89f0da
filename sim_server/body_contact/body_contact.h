// Contacts of two bodies: vertices of one body in, or close above, the surface of the other.
#pragma once

#include <vector>

#include "sim_server/collision/collision_engine.h"

namespace sectio {

struct BodyContact {
  VertexId vertex = kNone;  // of the first body
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the other body's surface
  double depth_m = 0;                 // negative: a gap
  TriangleId triangle = kNone;        // of the other body, nearest to the point
  Vec3 bary = Vec3::Zero();
};

constexpr std::size_t kMaxProbedVertices =
    64;  // probed at most near the other body; evenly chosen by number when there are more
constexpr double kDeepestContactM = 0.005;  // deeper contacts have no reliable nearest surface

// Appends contacts of the vertices of `one` at most reach_m above the surface of `other`, in order of vertex. The tree
// must be up to date. O(vertices of one + probed x log triangles of other).
void find_contacts(const SurfaceView& one, const SurfaceView& other, const CollisionEngine& tree_of_other,
                   double reach_m, std::vector<BodyContact>& contacts);

}  // namespace sectio
