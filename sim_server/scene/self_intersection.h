// Finds the places where a surface goes through itself.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct TrianglePair {
  TriangleId a = kNone, b = kNone;  // a < b
  Vec3 point = Vec3::Zero();        // near where they meet, in the soup's frame and unit
};

struct SelfIntersections {
  std::vector<TrianglePair> pairs;  // ascending; at most max_pairs
  bool complete = true;             // false when the search was given up: too many pairs, or too many close triangles
};

// Pairs of triangles that meet elsewhere than in the corners and edges they share; touching counts. A bounding volume
// hierarchy finds the candidates; signs of volumes within rounding of zero count as zero. O(n log n) for ordinary
// surfaces, bounded for hostile ones.
SelfIntersections find_self_intersections(const TriangleSoup& soup, std::size_t max_pairs = 1000);

}  // namespace sectio
