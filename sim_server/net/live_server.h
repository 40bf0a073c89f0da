// One server's part in a session, from its beginning to its end: it leads, or stands by until it has to.
#pragma once

#include <chrono>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "sim_server/net/budget.h"
#include "sim_server/net/live_session.h"
#include "sim_server/net/world_view.h"

namespace sectio {

class LiveServer {
 public:
  // Both arguments outlive it; the scene is a prepared one.
  LiveServer(const Scene& scene, const ServeOptions& options);
  RunResult run();

 private:
  using Clock = std::chrono::steady_clock;

  void go_on();
  void wait_for_peers();
  void lead();
  void obey_all(std::span<const SessionOrder> orders);
  void obey(const SessionOrder& order);
  void tell_of_refused_orders();
  void wait_in_pause();
  bool follows_hands() const { return !session_.past && !session_.options.play_traces; }
  void refuse(const SessionOrder& order, const std::string& why);
  void go_to(const SessionOrder& order);
  void displace_hands();
  void begin(LiveSession::Try next);
  void keep_session(std::uint64_t claimed_epoch);
  void show_now();
  void recall_orders();
  void keep_orders() const;
  void expect_hands();
  void begin_term();
  void tell(EventKind kind, const std::string& text);
  void tell_faults();
  void tell_score();
  bool take_input();
  void run_step();
  RunResult finish();

  LiveSession session_;
  WorldView world_;
  BudgetPlanner planner_;
  SyncCost cost_;
  double stall_s_;
  std::set<std::uint32_t> went_away_;  // tools whose hands are elsewhere than they were when the session paused
  bool touched_ = false;               // an instrument touched something in the last step
  Clock::time_point due_;
  std::uint64_t refused_told_ = 0;  // orders that came too fast
  Clock::time_point next_refused_{};
};

}  // namespace sectio
