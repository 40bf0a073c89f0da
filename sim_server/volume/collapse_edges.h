// Short edges that cuts have left collapse, one a step, while no instrument is at the body. At the surface a collapse
// is a delta as that of a cut is; inside it changes the volume alone.
#pragma once

#include <optional>

#include "sim_server/volume/volume.h"

namespace sectio {

// How far the search for short edges has come. It goes round through all vertices until a round finds none.
struct CollapseSearch {
  VertexId next = kNone;       // the vertex to look at next; kNone: there is nothing to find
  bool has_collapsed = false;  // an edge has, in this round

  bool is_done() const { return next == kNone; }

  template <class A>
  void archive(A& a) {
    a(next, has_collapsed);
  }
};

struct EdgeCollapse {
  VertexId v = kNone, onto = kNone;
  SurfaceMap::Change slots;
};

// Looks at the next few vertices. `ratio`: see TetCutSettings::collapse_ratio. `delta`: what the collapse does to the
// surface.
std::optional<EdgeCollapse> plan_collapse(const Volume& volume, const SharedBody& body, double ratio,
                                          CollapseSearch& search, TopologyDelta& delta);

// Call once the body has the delta.
void collapse(Volume& volume, const SharedBody& body, const EdgeCollapse& planned);

}  // namespace sectio
