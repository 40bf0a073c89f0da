#include "sim_server/volume/volume_front.h"

#include "common/core/sort_unique.h"

namespace sectio {

std::vector<VertexId> VolumeFront::without_front(const std::vector<VertexId>& vertices) const {
  const auto is_made = [&](VertexId v) { return v >= delta.vertices_before; };
  std::vector<VertexId> found;
  std::vector<VertexId> made;
  for (const VertexId v : vertices) (is_made(v) ? made : found).push_back(v);
  if (made.empty()) return vertices;
  for (std::size_t k = 0; k < made.size(); ++k)
    for (const VertexId v : std::array(delta.added[made[k] - delta.vertices_before].from))
      (is_made(v) ? made : found).push_back(v);
  sort_unique(found);
  return found;
}

}  // namespace sectio
