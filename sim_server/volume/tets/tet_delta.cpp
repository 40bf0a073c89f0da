#include "sim_server/volume/tets/tet_delta.h"

#include <utility>

namespace sectio {

TetDelta inverse(TetDelta delta) {
  std::swap(delta.removed, delta.added);
  std::swap(delta.tetrahedra_before, delta.tetrahedra_after);
  std::swap(delta.stars_before, delta.stars_after);
  for (TetEdit& e : delta.tetrahedra) std::swap(e.before, e.after);
  return delta;
}

TetChange change_of(const TetDelta& delta) {
  TetChange change;
  change.first_added = static_cast<VertexId>(delta.vertices_before);
  for (const TetDelta::Vertex& v : delta.added) change.added_body_m.push_back(v.rest_body_m);
  change.tetrahedra = delta.tetrahedra;
  return change;
}

}  // namespace sectio
