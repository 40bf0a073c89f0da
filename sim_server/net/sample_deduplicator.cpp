#include "sim_server/net/sample_deduplicator.h"

namespace sectio {

bool SampleDeduplicator::accept(const ToolPacket& packet, double now_s, std::vector<ToolSample>& samples) {
  const auto before = packet.tool_id < tools_.size() ? tools_[packet.tool_id].speaker.source() : std::nullopt;
  if (packet.tool_id >= tools_.size() || !tools_[packet.tool_id].speaker.hears(packet.source, now_s)) {
    ++refused_;
    return false;
  }
  Tool& tool = tools_[packet.tool_id];
  if (before != packet.source) tool.any = false;
  tool.speaks = true;
  tool.expected_s.reset();
  for (const ToolSample& sample : packet.samples) {
    if (tool.any && sample.sequence <= tool.last_sequence) continue;
    if (tool.any) lost_ += sample.sequence - tool.last_sequence - 1;
    tool.last_sequence = sample.sequence;
    tool.any = true;
    samples.push_back(sample);
    samples.back().tool_id = packet.tool_id;
    samples.back().source = packet.source;
  }
  return true;
}

void SampleDeduplicator::expect(std::uint32_t tool_id, double now_s) {
  Tool& tool = tools_.at(tool_id);
  if (!tool.speaks) tool.expected_s = now_s;
}

std::vector<std::uint32_t> SampleDeduplicator::take_silent(double now_s) {
  std::vector<std::uint32_t> silent;
  for (std::uint32_t t = 0; t < tools_.size(); ++t) {
    Tool& tool = tools_[t];
    const double silent_s =
        tool.speaks ? tool.speaker.silent_s(now_s).value_or(0) : now_s - tool.expected_s.value_or(now_s);
    if (silent_s <= kSilence_s) continue;
    tool.speaks = false;
    tool.expected_s.reset();
    silent.push_back(t);
  }
  return silent;
}

}  // namespace sectio
