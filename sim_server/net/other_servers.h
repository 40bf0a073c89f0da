// One server's knowledge of the other servers of its session, each of which has a share of the bodies.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/net/rivalry.h"
#include "sim_server/net/server_endpoints.h"
#include "sim_server/net/standbys.h"

namespace sectio {

class OtherServers {
 public:
  static constexpr double kSilence_s = 1;    // a server counts as dead when it is silent for longer
  static constexpr double kAbsence_s = 5;    // so long after it was halted, a server believes that it was followed
  static constexpr double kFarBehind_s = 1;  // nobody waits for a server that is further behind: it has come late

  // `own`: the scene that this server announces. The endpoints outlive it.
  OtherServers(ServerEndpoints& endpoints, const SceneInfo& own);

  // Takes what has arrived. One thread; the other functions are for any thread.
  void listen();

  // Bodies of the scene that no server has announced yet.
  std::vector<std::string> missing_bodies() const;
  // This server has simulated so much. Any thread.
  void advance(double sim_time_s) { own_time_s_ = sim_time_s; }

  // The number of servers that have announced themselves.
  std::size_t count() const;
  // The server for which a standby of these bodies stands by: of a session the one with the latest term. Nothing: none
  // has been heard.
  std::optional<std::uint64_t> leader() const;
  bool has_ended(std::uint64_t epoch) const;
  // The server announces what this one does: a scene with other instruments, tasks or looks is another one.
  bool has_our_scene(std::uint64_t epoch) const;
  // Servers are known, and none of them has our scene's bodies.
  bool is_among_strangers() const;
  // Another server runs a session with our bodies.
  bool is_held() const;
  // This server has this epoch from now on. No other function may run meanwhile.
  void become(std::uint64_t epoch) { own_.epoch = epoch; }

  // Another server has taken our session over, and sends states: this one is a ghost.
  bool is_replaced() const;
  // A later term of our session, claimed by a program that can't know that this server is silent: it has not stood by,
  // and this server has not been away.
  std::optional<std::uint64_t> false_claim() const;
  // The program stands by for the server with this epoch.
  void know_standby(const ProgramId& program, std::uint64_t epoch);
  // How many programs that stand by are there, for whichever epoch.
  std::size_t standbys() const;
  // How many other standbys go on, rather than this one, when the server with this epoch dies.
  std::size_t standbys_before_this(std::uint64_t epoch) const;
  // The first of our bodies that another server has with more right (rivalry.h): then this server has to end.
  std::optional<std::string> claimed_body() const;
  // The simulated time of the slowest server that is worth waiting for, and of the one that is furthest; nothing when
  // no other server speaks.
  std::optional<double> slowest_s() const;
  std::optional<double> furthest_s() const;

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds(Clock::time_point t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); }
  struct Other {
    std::string body;       // first body that both have; empty: none
    double sim_time_s = 0;  // 0: it has not begun
    int states = 0;         // states heard, each later than the one before
    Clock::time_point heard{};
    void hear(double time_s, double own_time_s) {
      states += time_s > sim_time_s;
      sim_time_s = time_s;
      heard = Clock::now();
      rivalry.hear(time_s, own_time_s, seconds(heard));
    }
    Rivalry rivalry;
    ProgramId program{};         // the one that announced it
    bool after_absence = false;  // announced when this server had been away
    bool same_world = false;
    bool same_scene = false;
    bool ended = false;
  };

  bool goes_along(std::uint64_t epoch, const Other& other) const;
  bool is_silent(const Other& other) const;
  bool speaks(const Other& other) const;
  bool is_succeeded(std::uint64_t epoch) const;
  bool has_more_right(std::uint64_t epoch, const Other& other) const;
  bool may_follow(std::uint64_t epoch, const Other& other) const;
  bool is_claimed_falsely(std::uint64_t epoch, const Other& other) const;
  void notice_absence();

  ServerEndpoints& endpoints_;
  SceneInfo own_;
  std::atomic<double> own_time_s_{0};

  mutable std::mutex mutex_;
  std::vector<std::string> missing_;
  std::map<std::uint64_t, Other> others_;  // by epoch
  Standbys standbys_;
  std::optional<Clock::time_point> listened_, was_away_;
};

}  // namespace sectio
