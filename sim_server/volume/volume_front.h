// The temporary front of blades in a volume: the tissue parts up to their edges, inside elements. The
// front is undone exactly and made anew, further on, each time that a blade has gone on a little. It becomes final, as
// it is, where the blade stops.
#pragma once

#include <map>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/volume/surface_map.h"
#include "sim_server/volume/tets/tet_delta.h"

namespace sectio {

using SurfaceLabels = std::map<Corners3, Surface>;  // by corners in the volume, ascending

struct VolumeFront {
  TetDelta delta;        // from the volume without the front to that with it
  SurfaceLabels labels;  // the triangles of the surface that the front has divided
  double open_m2 = 0;    // the area that it has opened, both sides together

  // Vertices of the front are replaced by those that they were made from. Ascending when any was.
  std::vector<VertexId> without_front(const std::vector<VertexId>& vertices) const;

  template <class A>
  void archive(A& a) {
    a(delta, labels, open_m2);
  }
};

}  // namespace sectio
