#include "sim_server/net/intake.h"

namespace sectio {

Intake::Intake(ServerEndpoints& endpoints, std::size_t tools)
    : endpoints_(endpoints), tools_(tools), deduplicator_(tools) {}

void Intake::take_samples(std::vector<ToolSample>& samples) {
  while (const auto packet = endpoints_.take<ToolPacket>()) {
    if (packet->tool_id >= tools_)
      log_limited(LogLevel::warning, "unknown tool",
                  "a device bridge moves tool " + std::to_string(packet->tool_id) + "; the scene has " +
                      std::to_string(tools_) + (tools_ == 1 ? " tool" : " tools") + ", numbered from 0");
    deduplicator_.accept(*packet, samples);
  }
}

std::optional<Vec3> Intake::take_gravity() {
  std::optional<Vec3> gravity;
  while (const auto request = endpoints_.take<GravityRequest>()) {
    if (request->source <= last_gravity_source_) continue;
    last_gravity_source_ = request->source;
    gravity = request->gravity_m_per_s2;
  }
  return gravity;
}

}  // namespace sectio
