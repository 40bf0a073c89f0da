// A standby's knowledge of the server for which it stands by: the inputs of its steps, in order and without holes, and
// whether it lives. Simulation's thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "common/core/attentive_clock.h"
#include "common/core/unique_id.h"
#include "sim_server/net/server_endpoints.h"

namespace sectio {

class Follower {
 public:
  static constexpr double kTakeOver_s = 0.1;  // a server that is silent for longer is followed by its standby

  // Between two looks at it; more is time in which this program was halted.
  static constexpr double kLongestLook_s = 0.01;

  explicit Follower(ServerEndpoints& endpoints) : endpoints_(endpoints) {}

  // Takes what has come and asks for what is missing. `leader`: the epoch of the server that has our bodies now. A
  // later term of the session is followed from then on: first its server sends the last step that was taken here once
  // more, so that both know that they have the same past.
  void listen(std::optional<std::uint64_t> leader);
  // These steps are known from elsewhere: the next one to take is the one after them. `last`: the last of them, which
  // the server has to confirm; nothing: it needs no confirmation.
  void begin_after(std::uint64_t steps, std::optional<StepRecord> last = {});
  // The next step, once: 1, 2, 3, ...
  std::optional<StepRecord> take_step();

  // The epoch of the last server that was heard; nothing: none.
  std::optional<std::uint64_t> epoch() const { return epoch_; }
  bool heard_any() const { return heard_any_; }  // this server or one before it
  bool hears() const { return heard_; }
  // A server has been heard, and has been silent for so long since. Time in which this program did not look, as when
  // it was halted itself, doesn't count.
  double silence_s() const { return silence_s_; }
  // A server of the session has been known for so long, by the same clock.
  double known_s() const { return known_s_; }
  // The newest step of the server, and those that have been taken.
  std::uint64_t newest_step() const { return newest_step_; }
  std::uint64_t steps_taken() const { return next_step_ - 1; }
  // The server's past isn't ours: it has fewer steps than have been taken, or another one.
  bool is_astray() const { return is_astray_; }
  // The server has sent all outputs of this step, and of those before it.
  std::uint64_t steps_sent() const { return steps_sent_; }
  // The last status of that server; nothing: none has come since the last call.
  std::optional<ServerStatus> take_status() { return std::exchange(status_, std::nullopt); }
  // Nothing of a server's inputs has come for a while. Once each time; the next one takes longer.
  bool is_deaf();
  // Steps are missing, and the server doesn't have them: this standby came too late.
  bool is_lost() const { return futile_s_ > kPatience_s; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr double kPatience_s = 5;
  static constexpr double kDeaf_s = 2, kMostDeaf_s = 30;
  void turn_to(std::uint64_t leader);
  void take(StepRecord step);
  void ask(double passed_s);
  std::uint64_t wanted_step() const { return unconfirmed_ ? last_->step : next_step_; }

  ServerEndpoints& endpoints_;
  std::uint64_t client_ = unique_id(kProgramIdBits);
  std::optional<std::uint64_t> epoch_;
  std::optional<ServerStatus> status_;
  std::map<std::uint64_t, StepRecord> steps_;  // steps that wait for those before them
  std::uint64_t next_step_ = 1, newest_step_ = 0, steps_sent_ = 0;
  std::optional<StepRecord> last_;  // the last one that was taken
  bool unconfirmed_ = false;        // this server has not sent that one yet
  bool is_astray_ = false;
  bool heard_ = false;      // this server has been heard
  bool heard_any_ = false;  // any server has been heard
  double known_s_ = 0, silence_s_ = 0, futile_s_ = 0, deaf_s_ = 0, deaf_after_s_ = kDeaf_s;
  std::uint64_t wanted_ = 0;
  AttentiveClock clock_{kLongestLook_s};
  Clock::time_point asked_{};
};

}  // namespace sectio
