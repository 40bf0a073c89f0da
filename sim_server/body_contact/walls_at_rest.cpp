#include "sim_server/body_contact/walls_at_rest.h"

#include <algorithm>

namespace sectio {
namespace {

Box3 box_at_rest(const TriangleMesh& mesh, TriangleId t) {
  Box3 box;
  for (const VertexId v : mesh.triangle(t).v) box.extend(mesh.rest_body_m(v));
  return box;
}

}  // namespace

bool is_wall(const TriangleMesh& mesh, TriangleId t) {
  return t < mesh.triangle_slots() && mesh.triangle(t).alive() && mesh.triangle(t).surface == Surface::wall;
}

void WallsAtRest::add_around(const TriangleMesh& mesh, VertexId v) {
  for (const TriangleId t : mesh.fan(v)) {
    if (!is_wall(mesh, t)) continue;
    const Box3 box = box_at_rest(mesh, t);
    const Key low = key(box.min()), high = key(box.max());
    for (int i = low[0]; i <= high[0]; ++i)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int k = low[2]; k <= high[2]; ++k) {
          std::vector<TriangleId>& cube = cubes_[{i, j, k}];
          if (std::ranges::find(cube, t) == cube.end()) cube.push_back(t);
        }
  }
}

bool WallsAtRest::reaches_into(const TriangleMesh& mesh, TriangleId t, const Key& cube) const {
  if (!is_wall(mesh, t)) return false;
  const Box3 box = box_at_rest(mesh, t);
  const Key low = key(box.min()), high = key(box.max());
  for (std::size_t i = 0; i < 3; ++i)
    if (cube[i] < low[i] || cube[i] > high[i]) return false;
  return true;
}

}  // namespace sectio
