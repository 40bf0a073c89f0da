// Takes away elements that cuts have left too thin (Ganovelli et al. 2000): an edge that is short beside the others of
// its tetrahedra goes, an end that is inside moves onto the other. The surface stays what it is.
#pragma once

#include <optional>

#include "sim_server/tet_cutting/tet_topology.h"

namespace sectio {

// 6 sqrt(2) V / l^3 with the root mean square of the edges, at rest: 1 for a regular tetrahedron, 0 for a flat one.
double shape_quality(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
double shape_quality(const TetTopology& volume, std::uint32_t t);

// The neighbour that v can move onto: over the shortest edge that is below `ratio` of the mean edge of its tetrahedra,
// such that no tetrahedron that changes gets worse than the worst at v was, and none turns over, at rest or where it is
// in the world. Nothing for a vertex of the surface. O(star^2).
std::optional<VertexId> collapse_onto(const TetTopology& volume, VertexId v, double ratio);

}  // namespace sectio
