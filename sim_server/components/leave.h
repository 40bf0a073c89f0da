// A part leaves its body: the body's delta that gives up the part's slots, and the mesh that the part goes on with.
// Rest positions and surfaces are the same bit for bit, so both together enclose what the body enclosed.
#pragma once

#include <vector>

#include "common/delta/topology_delta.h"
#include "sim_server/components/parts.h"

namespace sectio {

struct Leaving {
  TopologyDelta delta;                // of the body, at the revision of `mesh`
  TriangleMesh mesh;                  // of the part, at revision 0, without dead slots
  std::vector<VertexId> vertex_from;  // by vertex of the part: its slot in the body
};

// `part` must be a whole component of the mesh. O(part log part).
Leaving leave(const TriangleMesh& mesh, const Part& part);

}  // namespace sectio
