// The inputs of a session on their way to a standby (net/follower.h). While one is there, every step's input goes out
// before anything that the step has made, so that the standby knows at least as much as any viewer or hand. Programs
// that ask for steps of the past are served in turn, no faster than what leaves the wire free. Network's thread.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/core/token_bucket.h"
#include "sim_server/net/server_endpoints.h"
#include "sim_server/session/input_log.h"

namespace sectio {

class InputFeed {
 public:
  static constexpr double kPresence_s = 2;     // a standby that asks for nothing for longer has gone
  static constexpr std::size_t kSteps = 4096;  // a server without a log has so many of the past
  static constexpr double kPastBytes_per_s = 4e6, kPastBurstBytes = 4e5;  // for steps of the past
  static constexpr double kHeartbeat_s = 0.01;  // from one word that the server lives to the next

  // `log`: where steps of the past are; null: only the last kSteps are kept. Endpoints and log outlive it.
  InputFeed(ServerEndpoints& endpoints, std::uint64_t epoch, InputLog* log, std::size_t most_bytes)
      : endpoints_(endpoints), epoch_(epoch), log_(log), most_bytes_(most_bytes) {}

  // So many steps have been run before this term. `last`: those of them that were kept in memory.
  void go_on_after(std::uint64_t steps, std::deque<StepRecord> last);
  std::deque<StepRecord> take_last_steps() { return std::move(last_steps_); }
  // Programs that have stood by since the last call, and the epoch for which each did; 0: for any.
  std::map<ProgramId, std::uint64_t> take_standbys() { return std::exchange(standbys_, {}); }
  // The steps that the outbox holds, before their outputs.
  void send(std::span<const StepRecord> steps);
  // Answers requests for steps of the past, and says that this server lives. One whose simulation hangs doesn't: a
  // standby then goes on.
  void serve(bool lives);
  // All outputs up to this step have been sent.
  void sent(std::uint64_t step) { newest_step_ = step; }

 private:
  using Clock = std::chrono::steady_clock;
  bool standby_is_there() const;
  void write(std::vector<StepRecord> steps);
  void take_requests();
  void answer_next();
  std::vector<StepRecord> past_from(std::uint64_t first_step) const;

  ServerEndpoints& endpoints_;
  const std::uint64_t epoch_;
  InputLog* const log_;
  const std::size_t most_bytes_;
  TokenBucket past_bytes_{kPastBytes_per_s, kPastBurstBytes};
  std::deque<StepRecord> last_steps_;  // without a log
  std::uint64_t newest_step_ = 0;
  std::map<ProgramId, std::uint64_t> wanted_;  // the first step that each program asks for
  std::map<ProgramId, std::uint64_t> standbys_;
  ProgramId answered_{};  // the last one that was served
  std::optional<Clock::time_point> standby_heard_;
  Clock::time_point written_{};
};

}  // namespace sectio
