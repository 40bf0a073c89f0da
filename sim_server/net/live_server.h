// One server's part in a session, from its beginning to its end: it leads, or stands by until it has to.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/record/session_record.h"
#include "sim_server/net/budget.h"
#include "sim_server/net/pace.h"
#include "sim_server/net/serve.h"
#include "sim_server/net/world_view.h"
#include "sim_server/session/progress.h"
#include "sim_server/session/session_run.h"

namespace sectio {

// SIGINT or SIGTERM has come: the session ends in order.
bool stop_was_requested();
void catch_stop_signals();

class LiveServer {
 public:
  // Both arguments outlive it; the scene is a prepared one.
  LiveServer(const Scene& scene, const ServeOptions& options);
  RunResult run();

 private:
  using Clock = std::chrono::steady_clock;

  void go_on();
  void wait_for_peers();

  // The part of a standby: live_server_standby.cpp.
  bool follow();
  void rejoin_if_servers_are_there();
  void follow_step(const StepRecord& record);
  void keep_news();
  void take_over();

  void lead();
  std::optional<Pace::News> take(const SessionOrder& order);
  void obey(const SessionOrder& order);
  void wait_in_pause();
  void begin_anew(double from_s);
  void go_back(double to_s);
  std::string directory_of(int attempt) const;
  void tell(EventKind kind, const std::string& text);
  bool take_input();
  bool take_past_input();
  void run_unseen(double until_s);
  void run_step();
  RunResult finish();
  bool has_more_steps() const { return (!steps_ || run_->steps() < *steps_) && !stop_was_requested(); }

  const Scene& scene_;
  const ServeOptions& options_;
  const std::optional<std::uint64_t> steps_;
  std::optional<std::uint64_t> last_epoch_;  // of a session that goes on
  std::unique_ptr<SessionRun> run_;
  std::unique_ptr<InputLogReader> past_;  // that is played
  std::unique_ptr<SessionRecord> record_;
  std::unique_ptr<ServerNet> net_;

  StepInput input_;
  std::set<std::uint32_t> silent_;  // tools, while following or paused
  struct Recent {
    std::uint64_t step;
    std::vector<BodyDelta> deltas;
    std::vector<Event> events;
  };
  std::deque<Recent> recent_;  // steps, while following, whose outputs viewers may not have got
  WorldView world_;
  Progress progress_;
  Pace pace_;
  int tries_ = 1;
  BudgetPlanner planner_;
  SyncCost cost_;
  double stall_s_;
  Clock::time_point due_;
};

}  // namespace sectio
