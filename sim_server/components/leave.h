// Separates a part from its body: the delta that frees the part's slots in the body, and the mesh of the part alone.
// Rest positions and surfaces stay the same bit for bit, so that both together enclose the body's volume.
#pragma once

#include <vector>

#include "common/delta/topology_delta.h"
#include "sim_server/components/parts.h"

namespace sectio {

struct Leaving {
  TopologyDelta delta;                // for the body, at the revision of `mesh`
  TriangleMesh mesh;                  // mesh of the part, at revision 0, without dead slots
  std::vector<VertexId> vertex_from;  // by vertex of the part: its slot in the body
};

// `part` must be a whole component of the mesh. O(part log part).
Leaving leave(const TriangleMesh& mesh, const Part& part);

}  // namespace sectio
