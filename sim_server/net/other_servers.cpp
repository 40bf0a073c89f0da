#include "sim_server/net/other_servers.h"

#include <algorithm>

namespace sectio {

OtherServers::OtherServers(ServerEndpoints& endpoints, const SceneInfo& own)
    : endpoints_(endpoints), own_(own), missing_(own.world_bodies) {
  for (const BodyInfo& body : own.bodies) std::erase(missing_, body.name);
}

void OtherServers::listen() {
  while (const auto other = endpoints_.take<SceneInfo>()) {
    if (other->epoch == own_.epoch) continue;
    const std::lock_guard lock(mutex_);
    for (const BodyInfo& body : other->bodies) {
      std::erase(missing_, body.name);
      const bool ours = std::ranges::find(own_.bodies, body.name, &BodyInfo::name) != own_.bodies.end();
      if (ours && !claimed_ && other->epoch < own_.epoch) claimed_ = body.name;
    }
    if (other->world_bodies == own_.world_bodies) others_.try_emplace(other->epoch);
  }
  while (const auto header = endpoints_.take<StateHeader>()) {
    const std::lock_guard lock(mutex_);
    if (const auto other = others_.find(header->epoch); other != others_.end())
      other->second = {header->sim_time_s, Clock::now(), other->second.ended};
  }
  while (const auto end = endpoints_.take<SessionEnd>()) {
    const std::lock_guard lock(mutex_);
    if (const auto other = others_.find(end->epoch); other != others_.end()) other->second.ended = true;
  }
}

std::vector<std::string> OtherServers::missing_bodies() const {
  const std::lock_guard lock(mutex_);
  return missing_;
}

std::optional<std::string> OtherServers::claimed_body() const {
  const std::lock_guard lock(mutex_);
  return claimed_;
}

std::optional<double> OtherServers::slowest_s() const {
  const std::lock_guard lock(mutex_);
  std::optional<double> slowest;
  for (const auto& [epoch, other] : others_)
    if (!other.ended && std::chrono::duration<double>(Clock::now() - other.heard).count() < kSilence_s)
      slowest = std::min(slowest.value_or(other.sim_time_s), other.sim_time_s);
  return slowest;
}

}  // namespace sectio
