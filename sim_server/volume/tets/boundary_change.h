// The change of a volume's surface that follows from a change of its tetrahedra. Only changed tetrahedra are looked at:
// a face is removed if one of them had it before the change, and none or two have it after; it is added in the opposite
// case.
#pragma once

#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

// Corners are numbered as in the volume, counter-clockwise from outside; faces are in the order of the tetrahedra.
struct BoundaryChange {
  std::vector<std::array<VertexId, 3>> removed, added;
};

// `edits` must include tetrahedra of which only a neighbour has changed, as those of TetTopology::change() do.
// O(edits).
BoundaryChange boundary_change(std::span<const TetEdit> edits);

}  // namespace sectio
