// The servers of a session have a share of its bodies each. One server's knowledge of the others.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/net/server_endpoints.h"

namespace sectio {

class OtherServers {
 public:
  static constexpr double kSilence_s = 1;  // a server that is silent for longer is taken for dead

  // `own`: the scene that this server announces. The endpoints outlive it.
  OtherServers(ServerEndpoints& endpoints, const SceneInfo& own);

  // Takes what has arrived. One thread; the other functions are for any thread.
  void listen();

  // Bodies of the scene that no server has announced yet.
  std::vector<std::string> missing_bodies() const;
  // The first of our bodies that an older server has, too: then this server has to end.
  std::optional<std::string> claimed_body() const;
  // The simulated time of the slowest server; nothing when no other server speaks.
  std::optional<double> slowest_s() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Other {
    double sim_time_s = 0;
    Clock::time_point heard{};
    bool ended = false;
  };

  ServerEndpoints& endpoints_;
  SceneInfo own_;

  mutable std::mutex mutex_;
  std::vector<std::string> missing_;
  std::optional<std::string> claimed_;
  std::map<std::uint64_t, Other> others_;  // by epoch
};

}  // namespace sectio
