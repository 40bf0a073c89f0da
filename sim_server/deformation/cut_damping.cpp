#include "sim_server/deformation/cut_damping.h"

namespace sectio {

void CutDamping::watch(VertexId v) {
  const auto at = std::ranges::lower_bound(watched_, v);
  if (at == watched_.end() || *at != v) watched_.insert(at, v);
}

void CutDamping::forget(VertexId v) {
  const auto at = std::ranges::lower_bound(watched_, v);
  if (at != watched_.end() && *at == v) watched_.erase(at);
}

}  // namespace sectio
