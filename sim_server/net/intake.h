// Everything that a running session takes in: poses of instruments, their silence, and orders. The simulation's thread
// only; nothing blocks.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "common/core/attentive_clock.h"
#include "sim_server/net/order_limit.h"
#include "sim_server/net/sample_deduplicator.h"
#include "sim_server/net/server_endpoints.h"
#include "sim_server/net/speed_limit.h"

namespace sectio {

class Intake {
 public:
  // `tools`: the number of tools of the scene; none is followed faster than its limit, where it has one of its own. The
  // endpoints outlive the intake.
  Intake(ServerEndpoints& endpoints, std::size_t tools, std::span<const double> fastest_m_per_s);

  // Appends the samples that have arrived since the last call, each once, in order of sequence for each tool.
  void take_samples(std::vector<ToolSample>& samples);

  // The tools for which nobody has spoken for SampleDeduplicator::kSilence_s, each once a silence.
  std::vector<std::uint32_t> take_silent_tools();

  // The tool is in the scene, whether somebody has spoken for it or not.
  void expect(std::uint32_t tool_id);

  // Nobody moves a frozen tool: what its hand says is heard, so that it isn't silent, and is not followed.
  void set_frozen(std::uint32_t tool_id, bool frozen);
  std::uint32_t frozen_tools() const { return frozen_; }  // bit t: tool t

  // The orders that came since the last call, each once; of a program that gives too many only some (order_limit.h).
  std::vector<SessionOrder> take_orders();
  // Orders that came too fast.
  std::uint64_t orders_refused() const { return order_limit_.refused(); }

  // Packets of unknown tools, and of a bridge while another one moves its tool.
  std::uint64_t samples_refused() const { return refused_ + deduplicator_.refused(); }

 private:
  bool may_move(const ProgramId& program, std::uint32_t tool_id);

  ServerEndpoints& endpoints_;
  std::size_t tools_;
  static constexpr double kLongestLook_s = 0.1;  // a server that was halted hears later what hands said meanwhile
  AttentiveClock clock_{kLongestLook_s};
  SampleDeduplicator deduplicator_;
  std::vector<Speaker> programs_;  // by tool: the program that moves it
  std::vector<SpeedLimit> limits_;
  std::uint32_t frozen_ = 0;
  std::uint64_t refused_ = 0;
  OrderLimit order_limit_;
  std::deque<std::uint64_t> order_sources_;  // the last that were heard: an order may come twice
};

}  // namespace sectio
