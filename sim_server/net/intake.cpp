#include "sim_server/net/intake.h"

#include <algorithm>

#include "common/core/wall_time.h"
#include "common/dds/keys.h"

namespace sectio {

namespace {

constexpr std::size_t kOrderSources = 1024;  // at least 25 s of them (order_limit.h)
constexpr int kOrdersAtOnce = 1024;          // others wait until the next step

}  // namespace

Intake::Intake(ServerEndpoints& endpoints, std::size_t tools, std::span<const double> fastest_m_per_s)
    : endpoints_(endpoints),
      tools_(tools),
      deduplicator_(tools),
      programs_(tools),
      limits_(fastest_m_per_s.begin(), fastest_m_per_s.end()) {
  limits_.resize(tools, SpeedLimit());
}

// With keys, a trainee moves one instrument and no other.
bool Intake::may_move(const ProgramId& program, std::uint32_t tool_id) {
  if (!endpoints_.participant().secured()) return true;
  const std::optional<std::uint32_t> own = instrument_of_trainee(program);
  if (!own || *own == tool_id) return true;
  ++refused_;
  log_limited(LogLevel::warning, "trainee",
              "trainee-" + std::to_string(*own) + " moves tool " + std::to_string(tool_id) +
                  ": it is not heard, because its keys are for tool " + std::to_string(*own));
  return false;
}

void Intake::take_samples(std::vector<ToolSample>& samples) {
  clock_.look();
  while (const auto packet = endpoints_.take<ToolPacket>()) {
    if (!may_move(endpoints_.sender<ToolPacket>(), packet->tool_id)) continue;
    const bool known = packet->tool_id < tools_;
    const double now_s = clock_.now_s();
    const bool is_holder = !known || programs_[packet->tool_id].hears(hash_of(endpoints_.sender<ToolPacket>()), now_s);
    if (!is_holder) ++refused_;
    const std::size_t first = samples.size();
    const bool heard = is_holder && deduplicator_.accept(*packet, now_s, samples);
    for (std::size_t i = first; i < samples.size(); ++i)
      samples[i].pose_world = limits_[packet->tool_id].follow(samples[i], steady_now_s());
    if (known && is_frozen(frozen_, packet->tool_id)) samples.resize(first);
    if (!known)
      log_limited(LogLevel::warning, "unknown tool",
                  "a device bridge moves tool " + std::to_string(packet->tool_id) + "; the scene has " +
                      std::to_string(tools_) + (tools_ == 1 ? " tool" : " tools") + ", numbered from 0");
    else if (!heard)
      log_limited(LogLevel::warning, "second bridge " + std::to_string(packet->tool_id),
                  "a second device bridge moves tool " + std::to_string(packet->tool_id) + ": it is not heard");
  }
}

std::vector<std::uint32_t> Intake::take_silent_tools() {
  clock_.look();
  return deduplicator_.take_silent(clock_.now_s());
}

void Intake::expect(std::uint32_t tool_id) {
  deduplicator_.expect(tool_id, clock_.now_s());
}

void Intake::set_frozen(std::uint32_t tool_id, bool frozen) {
  const std::uint32_t bit = 1u << tool_id;
  frozen_ = frozen ? frozen_ | bit : frozen_ & ~bit;
}

std::vector<SessionOrder> Intake::take_orders() {
  std::vector<SessionOrder> orders;
  for (int taken = 0; taken < kOrdersAtOnce; ++taken) {
    const auto order = endpoints_.take<SessionOrder>();
    if (!order) break;
    if (std::ranges::find(order_sources_, order->source) != order_sources_.end()) continue;
    if (!order_limit_.allows(endpoints_.sender<SessionOrder>(), order->kind, steady_now_s())) {
      log_limited(LogLevel::warning, "orders", "a program gives orders too fast: not all of them are obeyed");
      continue;
    }
    order_sources_.push_back(order->source);
    if (order_sources_.size() > kOrderSources) order_sources_.pop_front();
    orders.push_back(*order);
  }
  return orders;
}

}  // namespace sectio
