// Deltas of one body that wait, as they come over a network: in any order, with gaps, and now and then two that begin
// at the same revision and lead to different ones (a standby repeats one by one what its server has said as one).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "common/delta/topology_delta.h"

namespace sectio {

class DeltaQueue {
 public:
  void add(TopologyDelta delta);

  // The delta that leads furthest from this revision, but not beyond `most`; null: none does. Valid until it is
  // forgotten.
  const TopologyDelta* next(std::uint64_t from, std::uint64_t most = ~std::uint64_t{0}) const;
  // Whether deltas at hand lead from one revision to the other.
  bool links(std::uint64_t from, std::uint64_t to) const;
  // Drops the deltas that begin before this revision.
  void forget_before(std::uint64_t revision);
  // Drops a delta that next() has returned.
  void forget(const TopologyDelta& delta);
  void clear();

  bool empty() const { return deltas_.empty(); }
  std::size_t size() const { return deltas_.size(); }
  std::size_t edits() const { return edits_; }  // edits in all deltas

 private:
  std::map<std::pair<std::uint64_t, std::uint64_t>, TopologyDelta> deltas_;  // by first and last revision
  std::size_t edits_ = 0;
};

}  // namespace sectio
