#include "sim_server/deformation/short_springs.h"

#include <algorithm>

namespace sectio {
void ShortSprings::watch(VertexId v, double shortest_m) {
  const auto at = std::ranges::lower_bound(watched_, v, {}, &Watched::v);
  if (at != watched_.end() && at->v == v) {
    at->shortest_m = static_cast<float>(shortest_m);
  } else {
    watched_.insert(at, {v, static_cast<float>(shortest_m)});
  }
}

void ShortSprings::forget(VertexId v) {
  const auto at = std::ranges::lower_bound(watched_, v, {}, &Watched::v);
  if (at != watched_.end() && at->v == v) watched_.erase(at);
}

}  // namespace sectio
