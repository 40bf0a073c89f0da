#include "common/dds/find_session.h"

#include <chrono>
#include <set>
#include <thread>

#include "common/core/error.h"
#include "common/core/joined.h"
#include "common/core/log.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPollPeriod = std::chrono::milliseconds(20);
constexpr double kOthers_s = 0.7;  // wait for other sessions of the domain after the first one: two announcements

std::set<std::string> sessions_of_servers(const Participant& participant, std::uint32_t protocol) {
  std::set<std::string> sessions;
  for (const Peer& peer : participant.peers())
    if (peer.name == kServerName && peer.announcement->protocol == protocol)
      sessions.insert(peer.announcement->session);
  return sessions;
}

Clock::time_point after(double seconds) {
  constexpr double kForEver_s = 1e8;
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::min(seconds, kForEver_s)));
}

}  // namespace

bool find_session(NetworkOptions& options, double patience_s, const std::function<bool()>& stopped) {
  if (!options.session.empty()) return true;
  const std::string domain = "domain " + std::to_string(options.domain);
  const Participant participant(options, "session finder");
  log_info("looking for a session on " + domain);
  auto until = after(patience_s);
  std::set<std::string> sessions;
  for (bool any = false; Clock::now() < until; std::this_thread::sleep_for(kPollPeriod)) {
    if (stopped()) return false;
    sessions = sessions_of_servers(participant, options.protocol);
    if (!any && !sessions.empty()) until = after(kOthers_s);
    any = any || !sessions.empty();
  }
  if (sessions.empty()) throw InputError("--session: no server was found on " + domain);
  if (sessions.size() > 1)
    throw InputError("--session: expected one of " + joined(sessions) + ", the sessions on " + domain);
  options.session = *sessions.begin();
  return true;
}

}  // namespace sectio
