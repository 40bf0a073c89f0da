// A server that stands by: it runs the steps of another one, and takes its place when that one dies.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "sim_server/net/live_session.h"

namespace sectio {

class Standby {
 public:
  // The session outlives it.
  explicit Standby(LiveSession& session) : session_(session) {}

  // Runs the steps of another server. True when it has fallen silent, and this one is to go on; false at the end.
  // Throws std::runtime_error when this can be no standby for it.
  bool follow();
  void take_over();

 private:
  void rejoin_if_servers_are_there();
  void follow_step(const StepRecord& record);
  void keep_news();

  LiveSession& session_;
  struct Recent {
    std::uint64_t step;
    std::vector<BodyDelta> deltas;
    std::vector<Event> events;
  };
  bool knows_orders_ = false;  // it has heard which orders hold in the session
  std::deque<Recent> recent_;  // steps whose outputs viewers may not have got
};

}  // namespace sectio
