#include "sim_server/deformation/short_springs.h"

#include <algorithm>
#include <limits>

namespace sectio {

void ShortSprings::watch(VertexId v, std::span<const HalfEdge> springs) {
  auto at = std::ranges::lower_bound(watched_, v, {}, &Watched::v);
  if (at == watched_.end() || at->v != v) at = watched_.insert(at, {v});
  double shortest_m = std::numeric_limits<double>::infinity();
  for (const HalfEdge& spring : springs)
    if (spring.k > 0) shortest_m = std::min(shortest_m, spring.rest_length_m());
  at->shortest_m = static_cast<float>(shortest_m);
}

void ShortSprings::forget(VertexId v) {
  const auto at = std::ranges::lower_bound(watched_, v, {}, &Watched::v);
  if (at != watched_.end() && at->v == v) watched_.erase(at);
}

}  // namespace sectio
