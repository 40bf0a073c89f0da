// Bridges repeat each pose in several packets. The deduplicator passes every sample on once, in order. The identity of
// a sample is its tool, its source and its sequence number; no other part of the server drops samples by number.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/messages/speaker.h"
#include "common/messages/tool.h"

namespace sectio {

class SampleDeduplicator {
 public:
  // An instrument for which nobody speaks for longer is withdrawn, by the clock of the intake: later by a server whose
  // steps take long.
  static constexpr double kSilence_s = 1;

  explicit SampleDeduplicator(std::size_t tools) : tools_(tools) {}

  // Appends the samples that have not been seen yet, in ascending order of sequence. A source replaces one that has
  // fallen silent (common/messages/speaker.h) and may count from 1. False: the packet is refused. `now_s` ascends.
  bool accept(const ToolPacket& packet, double now_s, std::vector<ToolSample>& samples);

  // The tool is in the scene: it falls silent, too, if nobody ever speaks for it.
  void expect(std::uint32_t tool_id, double now_s);
  // The tools that have fallen silent since the last call, each once a silence.
  std::vector<std::uint32_t> take_silent(double now_s);

  std::size_t tools() const { return tools_.size(); }
  // Packets for tools that the scene doesn't have, and packets of a source while another one speaks.
  std::uint64_t refused() const { return refused_; }
  // Sequence numbers that never came.
  std::uint64_t lost() const { return lost_; }

 private:
  struct Tool {
    Speaker speaker;
    std::uint64_t last_sequence = 0;
    bool any = false;
    bool speaks = false;
    std::optional<double> expected_s;  // since when; nothing: somebody has spoken
  };
  std::vector<Tool> tools_;
  std::uint64_t refused_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace sectio
