#include "sim_server/net/standby.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "common/core/log.h"
#include "common/messages/epoch.h"

namespace sectio {
namespace {

constexpr double kRepeat_s = 0.5;    // a standby that takes over says again what was said so shortly before
constexpr double kMostLost_s = 0.5;  // a standby that is further behind than that can't take over
constexpr int kStepsPerLook = 64;
constexpr std::ptrdiff_t kMostSamplesKept = 4096;
constexpr auto kLookPeriod = std::chrono::milliseconds(1);

}  // namespace

bool Standby::follow() {
  log_info("standing by");
  Follower& server = session_.net->follower();
  server.begin_after(session_.run->steps());
  bool hears = false, in_step = false;
  while (!stop_was_requested()) {
    keep_news();
    server.listen(session_.net->others().leader());
    if (!hears && server.heard_any()) {
      hears = true;
      log_info("it hears the server");
    }
    int steps = 0;
    for (; steps < kStepsPerLook && !stop_was_requested(); ++steps) {
      const std::optional<StepRecord> record = server.take_step();
      if (!record) break;
      follow_step(*record);
    }
    if (!in_step && knows_orders_ && server.newest_step() > 0 && server.steps_taken() >= server.newest_step()) {
      in_step = true;
      log_info("it has caught up with the server at step " + std::to_string(session_.run->steps()) +
               (session_.pace.is_paused() ? ", which is paused" : ""));
    }
    if (!server.heard_any() && server.epoch() && session_.net->others().has_ended(*server.epoch()))
      throw std::runtime_error("the session ended before this standby had heard a step of it");
    if (server.is_deaf()) rejoin_if_servers_are_there();
    if (server.is_lost())
      throw std::runtime_error("the server doesn't keep its inputs (--export): a standby must be there when it begins");
    if (steps == 0 && server.silence_s() > Follower::kTakeOver_s)
      return !session_.net->others().has_ended(*server.epoch());
    if (steps == 0) std::this_thread::sleep_for(kLookPeriod);
  }
  return false;
}

// Two programs that start in the same moment on a busy machine may know of each other in one direction alone, for good:
// Fast DDS sends what it believes to be known to a peer never again. A new participant is known to both.
void Standby::rejoin_if_servers_are_there() {
  if (session_.net->servers_known() > 0)
    session_.net->rejoin("hears nothing of the server for which it stands by");
  else
    log_info("no server of the session is there yet");
}

// Poses and requests that the server may not have used when it dies. Orders may have come before this one was there.
void Standby::keep_news() {
  if (const auto status = session_.net->follower().take_status()) {
    knows_orders_ = true;
    const bool is_paused = status->speed == 0;
    session_.adopt({is_paused ? session_.pace.speed() : status->speed, is_paused, status->frozen_tools});
  }
  session_.net->take_samples(session_.input.samples);
  if (session_.input.samples.size() > kMostSamplesKept)
    session_.input.samples.erase(session_.input.samples.begin(), session_.input.samples.end() - kMostSamplesKept);
  for (const std::uint32_t tool : session_.net->take_silent_tools()) session_.silent.insert(tool);
  for (const SessionOrder& order : session_.net->take_orders()) session_.take(order);
}

void Standby::follow_step(const StepRecord& record) {
  if (const std::string why = difference(record, session_.run->simulation()); !why.empty())
    throw std::runtime_error("step " + std::to_string(record.step) + ": " + why +
                             " from that of the server: this is no standby for it");
  const auto start = std::chrono::steady_clock::now();
  const StepInput input = input_of(record);
  session_.run->begin_step(*session_.net->follower().epoch(), input);
  const StepOutput& output = session_.run->step(input);
  session_.run->end_step(output, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  session_.run->take_faults();
  session_.progress.show(output);
  for (const ToolPacket& packet : record.packets) {
    session_.silent.erase(packet.tool_id);
    std::erase_if(session_.input.samples, [&](const ToolSample& s) {
      return s.tool_id == packet.tool_id && s.source == packet.source && s.sequence <= packet.samples.back().sequence;
    });
  }
  if (record.turns_gravity) session_.input.gravity_m_per_s2.reset();
  recent_.push_back({output.step, output.deltas, output.events});
  const auto kept = static_cast<std::uint64_t>(kRepeat_s / session_.scene.step_s);
  while (!recent_.empty() && recent_.front().step + kept < session_.net->follower().steps_sent()) recent_.pop_front();
}

void Standby::take_over() {
  const Follower& server = session_.net->follower();
  const std::uint64_t lost = server.newest_step() - std::min(server.newest_step(), session_.run->steps());
  if (static_cast<double>(lost) * session_.scene.step_s > kMostLost_s)
    throw std::runtime_error("the server died before this standby had caught up: " + std::to_string(lost) +
                             " steps are missing; its own journal has them (--resume)");
  Succession succession = session_.succession(*server.epoch());
  for (const Recent& step : recent_) {
    succession.last_deltas.insert(succession.last_deltas.end(), step.deltas.begin(), step.deltas.end());
    succession.last_events.insert(succession.last_events.end(), step.events.begin(), step.events.end());
  }
  session_.net->take_over(std::move(succession));
  recent_.clear();
  log_warning("the server fell silent: this one goes on after step " + std::to_string(session_.run->steps()));
}

}  // namespace sectio
