#include "sim_server/net/other_servers.h"

#include <algorithm>
#include <cmath>

#include "common/core/log.h"
#include "common/messages/codec.h"
#include "common/messages/epoch.h"

namespace sectio {

namespace {

constexpr int kStatesOfAServer = 5;  // one message alone says little about who holds a session

// All that a scene's file says, without what a session adds to it: its epoch, and parts that have come off.
std::vector<std::uint8_t> scene_alone(SceneInfo info, const std::vector<std::string>& world_bodies) {
  info.epoch = 0;
  std::erase_if(info.bodies, [&](const BodyInfo& body) { return std::ranges::count(world_bodies, body.name) == 0; });
  return encode(info);
}

}  // namespace

OtherServers::OtherServers(ServerEndpoints& endpoints, const SceneInfo& own)
    : endpoints_(endpoints), own_(own), missing_(own.world_bodies) {
  for (const BodyInfo& body : own.bodies) std::erase(missing_, body.name);
}

// A server that was halted, or cut off by its machine, doesn't look here meanwhile.
void OtherServers::notice_absence() {
  const auto now = Clock::now();
  if (listened_ && std::chrono::duration<double>(now - *listened_).count() >= kSilence_s) was_away_ = now;
  listened_ = now;
}

void OtherServers::know_standby(const ProgramId& program, std::uint64_t epoch) {
  const std::lock_guard lock(mutex_);
  standbys_.hear(program, epoch, seconds(Clock::now()));
}

std::size_t OtherServers::standbys_before_this(std::uint64_t epoch) const {
  const ProgramId own = endpoints_.id();
  const std::lock_guard lock(mutex_);
  return standbys_.before(own, epoch, seconds(Clock::now()));
}

std::size_t OtherServers::standbys() const {
  const std::lock_guard lock(mutex_);
  return standbys_.count(seconds(Clock::now()));
}

void OtherServers::listen() {
  notice_absence();
  while (const auto other = endpoints_.take<SceneInfo>()) {
    if (other->epoch == own_.epoch) continue;
    const std::lock_guard lock(mutex_);
    const bool is_new = !others_.contains(other->epoch);
    Other& known = others_[other->epoch];
    known.program = endpoints_.owner(other->epoch).value_or(ProgramId{});
    if (is_new)
      known.after_absence = was_away_ && std::chrono::duration<double>(Clock::now() - *was_away_).count() < kAbsence_s;
    for (const BodyInfo& body : other->bodies) {
      std::erase(missing_, body.name);
      const bool ours = std::ranges::find(own_.bodies, body.name, &BodyInfo::name) != own_.bodies.end();
      if (ours && known.body.empty()) known.body = body.name;
    }
    known.same_world = other->world_bodies == own_.world_bodies;
    if (is_new && !known.same_world && known.body.empty() && !other->bodies.empty())
      log_limited(LogLevel::warning, "other scene",
                  "a server of another scene, with the body " + other->bodies.front().name +
                      ", is in this session: viewers show one of the two");
    known.same_scene = scene_alone(*other, own_.world_bodies) == scene_alone(own_, own_.world_bodies);
  }
  while (const auto header = endpoints_.take<StateHeader>()) {
    const std::lock_guard lock(mutex_);
    if (const auto other = others_.find(header->epoch); other != others_.end())
      other->second.hear(header->sim_time_s, own_time_s_);
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

std::size_t OtherServers::count() const {
  const std::lock_guard lock(mutex_);
  return others_.size();
}

std::optional<std::string> OtherServers::claimed_body() const {
  const std::lock_guard lock(mutex_);
  for (const auto& [epoch, other] : others_)
    if (has_more_right(epoch, other)) return other.body;
  return std::nullopt;
}

std::optional<std::uint64_t> OtherServers::leader() const {
  const std::lock_guard lock(mutex_);
  std::optional<std::uint64_t> leader;
  bool leads = false;
  for (const auto& [epoch, other] : others_) {
    if (other.body.empty() || other.ended || is_claimed_falsely(epoch, other)) continue;
    const bool leads_now = speaks(other);
    const bool better =
        !leader || takes_over(epoch, *leader) || leads_now > leads || (leads_now == leads && epoch > *leader);
    if (better) leader = epoch, leads = leads_now;
  }
  return leader;
}

bool OtherServers::has_ended(std::uint64_t epoch) const {
  const std::lock_guard lock(mutex_);
  const auto other = others_.find(epoch);
  return other != others_.end() && other->second.ended;
}

bool OtherServers::has_our_scene(std::uint64_t epoch) const {
  const std::lock_guard lock(mutex_);
  const auto other = others_.find(epoch);
  return other != others_.end() && other->second.same_scene;
}

bool OtherServers::is_among_strangers() const {
  const std::lock_guard lock(mutex_);
  const auto is_there = [](const auto& other) { return !other.second.ended; };
  const auto is_ours = [](const auto& other) { return !other.second.body.empty() || other.second.same_world; };
  return std::ranges::any_of(others_, is_there) && std::ranges::none_of(others_, is_ours);
}

bool OtherServers::speaks(const Other& other) const {
  return other.sim_time_s > 0 && !other.ended && !is_silent(other);
}

bool OtherServers::is_succeeded(std::uint64_t epoch) const {
  return std::ranges::any_of(others_, [&](const auto& other) { return takes_over(other.first, epoch); });
}

bool OtherServers::is_held() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(others_,
                             [&](const auto& other) { return !other.second.body.empty() && speaks(other.second); });
}

bool OtherServers::may_follow(std::uint64_t epoch, const Other& other) const {
  return other.after_absence || has_begun(other.program, epoch) || standbys_.has_heard(other.program);
}

bool OtherServers::is_replaced() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(others_, [&](const auto& other) {
    return takes_over(other.first, own_.epoch) && may_follow(other.first, other.second) && !other.second.body.empty() &&
           other.second.states >= kStatesOfAServer;
  });
}

std::optional<std::uint64_t> OtherServers::false_claim() const {
  const std::lock_guard lock(mutex_);
  std::optional<std::uint64_t> claim;
  for (const auto& [epoch, other] : others_)
    if (takes_over(epoch, own_.epoch) && !may_follow(epoch, other)) claim = epoch;
  return claim;
}

// Neither the program that began the session, nor the first that was heard of it, nor one that stood by; and the server
// that it says it follows still speaks.
bool OtherServers::is_claimed_falsely(std::uint64_t epoch, const Other& other) const {
  const auto first = others_.lower_bound(first_epoch(name_of_session(epoch)));
  if (has_begun(other.program, epoch) || first->second.program == other.program) return false;
  if (standbys_.has_heard(other.program)) return false;
  return std::ranges::any_of(others_, [&](const auto& each) {
    return takes_over(epoch, each.first) && each.second.program != other.program && speaks(each.second);
  });
}

bool OtherServers::is_silent(const Other& other) const {
  return std::chrono::duration<double>(Clock::now() - other.heard).count() >= kSilence_s;
}

bool OtherServers::has_more_right(std::uint64_t epoch, const Other& other) const {
  if (other.body.empty() || other.ended) return false;
  if (same_session(epoch, own_.epoch)) return false;  // is_replaced() says so
  if (other.sim_time_s > 0 && is_silent(other)) return false;
  return other.rivalry.gives_way(own_time_s_, epoch < own_.epoch, seconds(Clock::now()));
}

// It has other bodies of our session.
bool OtherServers::goes_along(std::uint64_t epoch, const Other& other) const {
  return other.same_world && other.body.empty() && !other.ended && !is_silent(other) && !is_succeeded(epoch);
}

std::optional<double> OtherServers::slowest_s() const {
  const std::lock_guard lock(mutex_);
  std::optional<double> slowest;
  for (const auto& [epoch, other] : others_)
    if (goes_along(epoch, other) && own_time_s_ - other.sim_time_s < kFarBehind_s)
      slowest = std::min(slowest.value_or(other.sim_time_s), other.sim_time_s);
  return slowest;
}

std::optional<double> OtherServers::furthest_s() const {
  const std::lock_guard lock(mutex_);
  std::optional<double> furthest;
  for (const auto& [epoch, other] : others_)
    if (goes_along(epoch, other)) furthest = std::max(furthest.value_or(other.sim_time_s), other.sim_time_s);
  return furthest;
}

}  // namespace sectio
