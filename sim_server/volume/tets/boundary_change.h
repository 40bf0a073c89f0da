// What a change of a volume does to its surface, from the tetrahedra that have changed and no others: a face that one
// tetrahedron had before and another number of them has now is gone, and the other way round.
#pragma once

#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

// Corners as numbered in the volume, counter-clockwise from outside; in the order of the tetrahedra.
struct BoundaryChange {
  std::vector<std::array<VertexId, 3>> removed, added;
};

// `edits`: of all tetrahedra at which something has changed, those included that only have a new neighbour or none
// any more (TetTopology::change()). O(edits).
BoundaryChange boundary_change(std::span<const TetEdit> edits);

}  // namespace sectio
