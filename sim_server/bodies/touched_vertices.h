// The vertices whose star a change of topology alters: what a deformation model has to recompute after it.
#pragma once

#include <vector>

#include "common/delta/topology_delta.h"

namespace sectio {

// Ascending, each once: vertices named by the delta and corners of its triangles before and after.
// `before` is the mesh to which the delta has not been applied yet. Cost O(n log n) in the size of the delta.
std::vector<VertexId> touched_vertices(const TopologyDelta& delta, const TriangleMesh& before);

}  // namespace sectio
