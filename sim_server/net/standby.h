// A server that stands by: it runs the steps of another one, and takes its place when that one dies.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/attentive_clock.h"
#include "sim_server/net/company.h"
#include "sim_server/net/live_session.h"

namespace sectio {

class Standby {
 public:
  // The session outlives it.
  explicit Standby(LiveSession& session) : session_(session) {}

  // Runs the steps of the server that leads the session, whichever program that is, and goes back when it does. True
  // when it has fallen silent, and this one is to go on; false at the end. Throws std::runtime_error when this can be
  // no standby for it.
  bool follow();
  void take_over();

 private:
  void begin_after(std::uint64_t steps);
  void rejoin_if_servers_are_there();
  void notice_another_server();
  void hear_company();
  bool is_to_go_on();
  bool is_far_behind() const;
  void go_back(const std::string& why);
  void follow_step(const StepRecord& record);
  void keep_news();

  LiveSession& session_;
  struct Recent {
    std::uint64_t step;
    std::vector<BodyDelta> deltas;
    std::vector<Event> events;
  };
  bool knows_orders_ = false;           // it has heard which orders hold in the session
  std::deque<Recent> recent_;           // steps whose outputs viewers may not have got
  std::deque<StepRecord> last_inputs_;  // without a journal
  Company company_;
  std::uint64_t hands_heard_ = 0, viewers_heard_ = 0;
  AttentiveClock clock_{Follower::kLongestLook_s};  // the same as that of Follower::silence_s()
  // In this silence of the server: it waits, and since when others have shown that the server is gone. All standbys
  // hear them at once.
  bool waits_ = false;
  std::optional<double> gone_since_s_ = {};
  std::uint64_t followed_ = 0;  // epoch of the server that was heard last
  bool in_step_ = false;
  int chances_ = 0;  // it may go back so often to find the past of its server; a past that it has made itself is right
};

}  // namespace sectio
