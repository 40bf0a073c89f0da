// Bridges repeat each pose in several packets. The deduplicator passes every sample on once, in order. The identity of
// a sample is its tool, its source and its sequence number; no other part of the server drops samples by number.
#pragma once

#include <cstdint>
#include <vector>

#include "common/messages/tool.h"

namespace sectio {

class SampleDeduplicator {
 public:
  explicit SampleDeduplicator(std::size_t tools) : tools_(tools) {}

  // Appends the samples that have not been seen yet, in ascending order of sequence. A newer source replaces the one
  // before it and may count from 1 again.
  void accept(const ToolPacket& packet, std::vector<ToolSample>& samples);

  std::size_t tools() const { return tools_.size(); }
  // Packets for tools that the scene doesn't have, and packets of a source that a newer one has replaced.
  std::uint64_t refused() const { return refused_; }
  // Sequence numbers that never came.
  std::uint64_t lost() const { return lost_; }

 private:
  struct Tool {
    std::uint64_t source = 0;
    std::uint64_t last_sequence = 0;
    bool any = false;
  };
  std::vector<Tool> tools_;
  std::uint64_t refused_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace sectio
