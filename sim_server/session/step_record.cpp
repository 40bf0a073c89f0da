#include "sim_server/session/step_record.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/math/hash.h"

namespace sectio {
namespace {

bool continues(const ToolPacket& packet, const ToolSample& sample) {
  return packet.tool_id == sample.tool_id && packet.source == sample.source &&
         packet.samples.size() < kMaxPosesPerPacket && packet.samples.back().sequence < sample.sequence;
}

}  // namespace

std::uint64_t steps_until(double time_s, double step_s) {
  constexpr double kMost = 1e18;
  return static_cast<std::uint64_t>(std::clamp(std::floor(time_s / step_s + 1e-6), 0.0, kMost));
}

std::uint64_t topology_hash_of(const Simulation& simulation) {
  std::uint64_t hash = simulation.body_count();
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b)
    hash = hash_combine(hash_combine(hash, simulation.mesh(b).revision()), simulation.mesh(b).hash());
  return hash;
}

std::uint64_t state_hash_of(const Simulation& simulation) {
  std::uint64_t hash = topology_hash_of(simulation);
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b)
    for (const Vec3f& x : simulation.positions_world_m(b)) {
      const auto bits = [&](int i) { return std::uint64_t{std::bit_cast<std::uint32_t>(x[i])}; };
      hash = hash_combine(hash_combine(hash, bits(0) << 32 | bits(1)), bits(2));
    }
  return hash == 0 ? 1 : hash;
}

StepRecord record_of(std::uint64_t step, const StepInput& input, const Simulation& before) {
  StepRecord record;
  record.step = step;
  record.hash_before = topology_hash_of(before);
  if (step % kStatesHashedEvery == 0) record.state_hash_before = state_hash_of(before);
  for (const ToolSample& sample : input.samples) {
    if (record.packets.empty() || !continues(record.packets.back(), sample))
      record.packets.push_back({sample.source, sample.tool_id, {}});
    record.packets.back().samples.push_back(sample);
  }
  record.withdrawn_tools = input.withdrawn;
  record.spare_idle_bodies = input.spare_idle_bodies;
  record.turns_gravity = input.gravity_m_per_s2.has_value();
  if (record.turns_gravity) record.gravity_m_per_s2 = *input.gravity_m_per_s2;
  record.overrun = input.overrun;
  return record;
}

StepInput input_of(const StepRecord& record) {
  StepInput input;
  for (const ToolPacket& packet : record.packets)
    for (ToolSample sample : packet.samples) {
      sample.tool_id = packet.tool_id;
      sample.source = packet.source;
      input.samples.push_back(sample);
    }
  input.withdrawn = record.withdrawn_tools;
  input.spare_idle_bodies = record.spare_idle_bodies;
  if (record.turns_gravity) input.gravity_m_per_s2 = record.gravity_m_per_s2;
  input.overrun = record.overrun;
  return input;
}

std::string difference(const StepRecord& record, const Simulation& before) {
  if (record.hash_before != topology_hash_of(before)) return "the topology before it differs";
  if (record.state_hash_before != 0 && record.state_hash_before != state_hash_of(before))
    return "the positions before it differ";
  return {};
}

}  // namespace sectio
