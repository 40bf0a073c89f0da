#include "common/delta/delta_queue.h"

#include <iterator>

namespace sectio {
namespace {

std::size_t edits_of(const TopologyDelta& delta) {
  return delta.vertices.size() + delta.triangles.size();
}

}  // namespace

void DeltaQueue::add(TopologyDelta delta) {
  const std::size_t edits = edits_of(delta);
  const std::pair key(delta.base_revision, delta.revision);
  if (deltas_.emplace(key, std::move(delta)).second) edits_ += edits;
}

const TopologyDelta* DeltaQueue::next(std::uint64_t from, std::uint64_t most) const {
  auto at = deltas_.upper_bound({from, most});
  if (at == deltas_.begin()) return nullptr;
  --at;
  return at->first.first == from ? &at->second : nullptr;
}

bool DeltaQueue::links(std::uint64_t from, std::uint64_t to) const {
  while (from < to) {
    const TopologyDelta* delta = next(from, to);
    if (delta == nullptr) return false;
    from = delta->revision;
  }
  return from == to;
}

void DeltaQueue::forget_before(std::uint64_t revision) {
  const auto end = deltas_.lower_bound({revision, 0});
  for (auto at = deltas_.begin(); at != end; at = deltas_.erase(at)) edits_ -= edits_of(at->second);
}

void DeltaQueue::forget(const TopologyDelta& delta) {
  const auto at = deltas_.find({delta.base_revision, delta.revision});
  if (at == deltas_.end()) return;
  edits_ -= edits_of(delta);
  deltas_.erase(at);
}

void DeltaQueue::clear() {
  deltas_.clear();
  edits_ = 0;
}

}  // namespace sectio
