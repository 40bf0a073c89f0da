#include "tests/support/replica_viewer.h"

#include <algorithm>
#include <chrono>

namespace sectio::test {

using Clock = std::chrono::steady_clock;

bool ReplicaViewer::look() {
  const double now_s = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
  net.poll(now_s, replica);
  const bool is_new = replica.frame(now_s, frame);
  frames += is_new;
  return is_new;
}

bool ReplicaViewer::knows(const std::vector<BodyVersion>& versions) {
  const auto& bodies = replica.bodies();
  if (bodies.size() != versions.size() || !std::ranges::all_of(bodies, [](const auto& b) { return b->known(); }))
    return false;
  return replica.catch_up() == versions;
}

}  // namespace sectio::test
