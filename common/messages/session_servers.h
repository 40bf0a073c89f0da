// The servers of a session, as a client hears them. Several may have a share of the bodies each, and one that takes the
// session over has a later term (epoch.h). The session has ended when a server has said so, and no other speaks.
#pragma once

#include <cstdint>
#include <map>

#include "common/messages/epoch.h"

namespace sectio {

class SessionServers {
 public:
  static constexpr double kSilence_s = 5;  // a server says its status several times a second
  static constexpr std::size_t kMost = 64;

  // Anything but its end. Servers whose session another one has taken over don't count.
  void hear(std::uint64_t epoch, double now_s) {
    if (Server* server = find(epoch)) server->heard_s = now_s;
  }
  void end(std::uint64_t epoch) {
    if (Server* server = find(epoch)) server->ended = true;
  }
  bool all_ended(double now_s) const {
    bool any = false;
    for (const auto& [epoch, server] : servers_) {
      any |= server.ended;
      if (!server.ended && now_s - server.heard_s < kSilence_s) return false;
    }
    return any;
  }

 private:
  struct Server {
    double heard_s = -1e300;
    bool ended = false;
  };
  Server* find(std::uint64_t epoch) {
    for (const auto& [other, server] : servers_)
      if (takes_over(other, epoch)) return nullptr;
    std::erase_if(servers_, [&](const auto& each) { return takes_over(epoch, each.first); });
    if (servers_.size() >= kMost && !servers_.contains(epoch)) return nullptr;
    return &servers_[epoch];
  }

  std::map<std::uint64_t, Server> servers_;  // by epoch
};

}  // namespace sectio
