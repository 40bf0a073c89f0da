#include "tests/support/replica_viewer.h"

#include <algorithm>
#include <thread>

namespace sectio::test {

using Clock = std::chrono::steady_clock;

bool wait_until(const std::function<bool()>& condition, const std::function<void()>& meanwhile) {
  const auto end = Clock::now() + kGiveUp;
  while (!condition()) {
    if (Clock::now() > end) return false;
    meanwhile();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

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
