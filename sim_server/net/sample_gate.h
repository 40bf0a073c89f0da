// Lets each pose of an instrument in once, in order, however often packets repeat it.
#pragma once

#include <cstdint>
#include <vector>

#include "common/messages/tool.h"

namespace sectio {

class SampleGate {
 public:
  explicit SampleGate(std::size_t tools) : tools_(tools) {}

  // Appends the samples not seen before, in ascending order of sequence.
  void accept(const ToolPacket& packet, std::vector<ToolSample>& samples);

  // Packets of tools that don't exist, and of a bridge that a newer one has replaced.
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
