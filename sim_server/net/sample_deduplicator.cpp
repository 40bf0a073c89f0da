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

std::vector<std::uint32_t> SampleDeduplicator::take_silent(double now_s) {
  std::vector<std::uint32_t> silent;
  for (std::uint32_t t = 0; t < tools_.size(); ++t) {
    Tool& tool = tools_[t];
    if (!tool.speaks || tool.speaker.silent_s(now_s).value_or(0) <= kSilence_s) continue;
    tool.speaks = false;
    silent.push_back(t);
  }
  return silent;
}

}  // namespace sectio
