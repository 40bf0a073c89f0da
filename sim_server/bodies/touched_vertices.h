// The vertices whose star a change of topology alters; a deformation model recomputes these.
#pragma once

#include <vector>

#include "common/delta/topology_delta.h"

namespace sectio {

// The vertices named by the delta and the corners of its triangles before and after it, ascending, each once. `before`
// is the mesh to which the delta has not been applied yet. O(n log n) in the size of the delta.
std::vector<VertexId> touched_vertices(const TopologyDelta& delta, const TriangleMesh& before);

}  // namespace sectio
