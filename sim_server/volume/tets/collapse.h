// Removes elements that cuts have left too thin (Ganovelli and O'Sullivan 2001): an edge that is short beside the other
// edges of its tetrahedra collapses, one end moving onto the other. The volume stays a manifold of the same shape,
// within the bounds given here, and no tetrahedron gets worse than the worst at the end that moves.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

// 6 sqrt(2) V / l^3 at rest, where l is the root mean square of the edges: 1 for a regular tetrahedron, 0 for a flat
// one.
double shape_quality(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
double shape_quality(const TetTopology& volume, std::uint32_t t);

// The length of an edge over the mean of all edges of its tetrahedra, at rest.
double edge_ratio(const TetTopology& volume, VertexId v, VertexId w);

// Tolerances in this mean edge m: kCollapseOff m is the largest distance between a vertex of the old surface and the
// new surface, or between a crease and its replacement; kCollapseVolume m^3 is the largest change of the enclosed
// volume.
inline constexpr double kCollapseOff = 0.02;
inline constexpr double kCollapseVolume = 2e-3;

// The label of a triangle of the surface, given by its corners counter-clockwise from outside. A lip is an edge between
// triangles of different labels.
using SurfaceLabel = std::function<int(const std::array<VertexId, 3>& corners)>;  // empty: one label for all

enum class CollapseVerdict : std::uint8_t {
  fine,
  torn,      // violates the link condition (Dey et al. 1999): two sides would be joined, or one pinched
  inward,    // a vertex of the surface would move inside
  corner,    // creases or lips end, meet or bend at the vertex
  sideways,  // the vertex would leave its crease or lip
  bent,      // the shape of the surface would change
  flat,      // a tetrahedron would be inverted, at rest or in the world, or worse or flatter than allowed
};
const char* to_string(CollapseVerdict verdict);

// Judges the collapse of v onto its neighbour w. O(star^2).
CollapseVerdict judge_collapse(const TetTopology& volume, VertexId v, VertexId w, const SurfaceLabel& kind = {});

// The neighbour that v can move onto, along the shortest edge with a ratio below `ratio` whose collapse is fine.
std::optional<VertexId> collapse_onto(const TetTopology& volume, VertexId v, double ratio,
                                      const SurfaceLabel& kind = {});

}  // namespace sectio
