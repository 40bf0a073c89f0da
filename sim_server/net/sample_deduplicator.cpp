#include "sim_server/net/sample_deduplicator.h"

namespace sectio {

void SampleDeduplicator::accept(const ToolPacket& packet, std::vector<ToolSample>& samples) {
  if (packet.tool_id >= tools_.size() || packet.source < tools_[packet.tool_id].source) {
    ++refused_;
    return;
  }
  Tool& tool = tools_[packet.tool_id];
  if (packet.source > tool.source) tool = {packet.source, 0, false};
  for (const ToolSample& sample : packet.samples) {
    if (tool.any && sample.sequence <= tool.last_sequence) continue;
    if (tool.any) lost_ += sample.sequence - tool.last_sequence - 1;
    tool.last_sequence = sample.sequence;
    tool.any = true;
    samples.push_back(sample);
    samples.back().tool_id = packet.tool_id;
    samples.back().source = packet.source;
  }
}

}  // namespace sectio
