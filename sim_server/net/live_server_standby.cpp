// A server that stands by: it runs the steps of another one, and goes on alone when that one dies.
#include <algorithm>
#include <stdexcept>
#include <thread>

#include "common/core/log.h"
#include "common/messages/epoch.h"
#include "sim_server/net/live_server.h"

namespace sectio {
namespace {

constexpr double kRepeat_s = 0.25;   // a standby that takes over says again what was said so shortly before
constexpr double kMostLost_s = 0.5;  // a standby that is further behind than that can't take over
constexpr int kStepsPerLook = 64;
constexpr std::ptrdiff_t kMostSamplesKept = 4096;
constexpr auto kLookPeriod = std::chrono::milliseconds(1);

}  // namespace

// Runs the steps of another server. True when it has fallen silent, and this one is to go on; false at the end.
bool LiveServer::follow() {
  log_info("standing by");
  Follower& server = net_->follower();
  bool in_step = false;
  while (!stop_was_requested()) {
    keep_news();
    server.listen(net_->others().leader());
    int steps = 0;
    for (; steps < kStepsPerLook && !stop_was_requested(); ++steps) {
      const std::optional<StepRecord> record = server.take_step();
      if (!record) break;
      follow_step(*record);
    }
    if (!in_step && server.newest_step() > 0 && server.steps_taken() >= server.newest_step()) {
      in_step = true;
      log_info("it has caught up with the server at step " + std::to_string(run_->steps()));
    }
    if (!server.heard_any() && server.epoch() && net_->others().has_ended(*server.epoch()))
      throw std::runtime_error("the session ended before this standby had heard a step of it");
    if (server.is_deaf()) rejoin_if_servers_are_there();
    if (server.is_lost())
      throw std::runtime_error("the server doesn't keep its inputs (--export): a standby must be there when it begins");
    if (steps == 0 && server.silence_s() > Follower::kTakeOver_s) return !net_->others().has_ended(*server.epoch());
    if (steps == 0) std::this_thread::sleep_for(kLookPeriod);
  }
  return false;
}

// Two programs that start in the same moment on a busy machine may know of each other in one direction alone, for good:
// Fast DDS sends what it believes to be known to a peer never again. A new participant is known to both.
void LiveServer::rejoin_if_servers_are_there() {
  if (net_->servers_known() > 0)
    net_->rejoin("hears nothing of the server for which it stands by");
  else
    log_info("no server of the session is there yet");
}

// Poses and requests that the server may not have used when it dies.
void LiveServer::keep_news() {
  net_->take_samples(input_.samples);
  if (input_.samples.size() > kMostSamplesKept)
    input_.samples.erase(input_.samples.begin(), input_.samples.end() - kMostSamplesKept);
  for (const std::uint32_t tool : net_->take_silent_tools()) silent_.insert(tool);
  for (const SessionOrder& order : net_->take_orders()) take(order);
}

void LiveServer::follow_step(const StepRecord& record) {
  if (const std::string why = difference(record, run_->simulation()); !why.empty())
    throw std::runtime_error("step " + std::to_string(record.step) + ": " + why +
                             " from that of the server: this is no standby for it");
  const auto start = Clock::now();
  const StepInput input = input_of(record);
  run_->begin_step(*net_->follower().epoch(), input);
  const StepOutput& output = run_->step(input);
  run_->end_step(output, std::chrono::duration<double>(Clock::now() - start).count());
  run_->take_faults();
  progress_.show(output);
  for (const ToolPacket& packet : record.packets) {
    silent_.erase(packet.tool_id);
    std::erase_if(input_.samples, [&](const ToolSample& s) {
      return s.tool_id == packet.tool_id && s.source == packet.source && s.sequence <= packet.samples.back().sequence;
    });
  }
  if (record.turns_gravity) input_.gravity_m_per_s2.reset();
  recent_.push_back({output.step, output.deltas, output.events});
  const auto kept = static_cast<std::uint64_t>(kRepeat_s / scene_.step_s);
  while (!recent_.empty() && recent_.front().step + kept < net_->follower().steps_sent()) recent_.pop_front();
}

void LiveServer::take_over() {
  const Follower& server = net_->follower();
  const std::uint64_t lost = server.newest_step() - std::min(server.newest_step(), run_->steps());
  if (static_cast<double>(lost) * scene_.step_s > kMostLost_s)
    throw std::runtime_error("the server died before this standby had caught up: " + std::to_string(lost) +
                             " steps are missing; its own journal has them (--resume)");
  Succession succession{next_term(*server.epoch()),
                        scene_info_now(scene_, run_->simulation()),
                        meshes_of(run_->simulation()),
                        {},
                        {},
                        run_->inputs(),
                        record_.get()};
  for (const Recent& step : recent_) {
    succession.last_deltas.insert(succession.last_deltas.end(), step.deltas.begin(), step.deltas.end());
    succession.last_events.insert(succession.last_events.end(), step.events.begin(), step.events.end());
  }
  net_->take_over(std::move(succession));
  recent_.clear();
  log_warning("the server fell silent: this one goes on after step " + std::to_string(run_->steps()));
}

}  // namespace sectio
