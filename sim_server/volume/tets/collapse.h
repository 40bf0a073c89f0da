// Removes elements that cuts have left too thin (Ganovelli and O'Sullivan 2001): an edge that is short beside the other
// edges of its tetrahedra collapses, one end moving onto the other. The volume stays a manifold of the same shape,
// within the bounds given here, and no tetrahedron gets worse than the worst at the end that moves.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

// 6 sqrt(2) V / l^3 with the root mean square of the edges, at rest: 1 for a regular tetrahedron, 0 for a flat one.
double shape_quality(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
double shape_quality(const TetTopology& volume, std::uint32_t t);

// Beside the mean over all edges of the tetrahedra that have it, at rest.
double edge_ratio(const TetTopology& volume, VertexId v, VertexId w);

// Of these mean edges m: how far a vertex of the surface may come to lie from the surface that is left, and a crease
// from the straight line in its place; and of m^3 how much the volume inside the surface may change.
inline constexpr double kCollapseOff = 0.02;
inline constexpr double kCollapseVolume = 2e-3;

// What a triangle of the surface is of, corners counter-clockwise from outside: where that changes is a lip.
using SurfaceLabel = std::function<int(const std::array<VertexId, 3>& corners)>;  // empty: all are alike

enum class CollapseVerdict : std::uint8_t {
  fine,
  torn,      // the link condition (Dey et al. 1999), surface included: two sides would be joined, or one pinched
  inward,    // from the surface into it
  corner,    // where creases or lips end, meet or bend
  sideways,  // off the crease or lip
  bent,      // the surface would have another shape
  flat,      // a tetrahedron turns over, at rest or in the world, or gets worse, or half as high, as the worst there
};
const char* to_string(CollapseVerdict verdict);

// Of v onto its neighbour w. O(star^2).
CollapseVerdict judge_collapse(const TetTopology& volume, VertexId v, VertexId w, const SurfaceLabel& kind = {});

// The neighbour that v can move onto: over the shortest edge below `ratio` for which nothing speaks against it.
std::optional<VertexId> collapse_onto(const TetTopology& volume, VertexId v, double ratio,
                                      const SurfaceLabel& kind = {});

}  // namespace sectio
