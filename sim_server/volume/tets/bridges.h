// Opens what still holds the two sides of a cut together: threads at a rim, and seams between two sheets.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

// The signed height of a place at rest over the surface along which a blade has cut; nothing far from it, or outside
// its outline.
using HeightOverCut = std::function<std::optional<double>(const Vec3& rest_m)>;

// Tetrahedra further than `side_m` from the surface belong to a side for certain. Between the two sides, the faces that
// have the least area together are opened, near the surface alone: a tetrahedron that only one side still holds stays
// with it, on whichever side of the surface it lies. `begin`: tetrahedra from which the search goes through faces.
// Returns the vertices on the opened faces, twins included, ascending; none when nothing opens.
std::vector<VertexId> open_bridges(TetTopology& volume, const HeightOverCut& height_m, double side_m,
                                   std::span<const std::uint32_t> begin);

}  // namespace sectio
