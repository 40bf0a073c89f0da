#include "sim_server/net/tilt.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "common/dds/endpoints.h"
#include "common/dds/find_session.h"
#include "common/messages/session_fields.h"
#include "common/messages/validate.h"

namespace sectio {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kTiltPollPeriod = std::chrono::milliseconds(20);

}  // namespace

void request_gravity(NetworkOptions network, const Vec3& gravity_m_per_s2, double patience_s) {
  const GravityRequest request{microseconds_since_1970(), gravity_m_per_s2};
  if (!first_flaw(request).empty())
    throw InputError("--gravity: expected at most " + std::to_string(std::lround(kMostGravity_m_per_s2)) + " m/s2");
  find_session(network, patience_s, [] { return false; });
  Endpoints<Reads<ServerStatus>, Writes<GravityRequest>> endpoints(network, "sim_server tilt");
  if (!endpoints.write(request)) throw InputError("tilt: DDS refused to send the request");

  std::map<std::uint64_t, bool> servers;  // by epoch: does it turn there?
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
  while (Clock::now() < until) {
    while (const auto status = endpoints.take<ServerStatus>())
      servers[status->epoch] = status->gravity_target_m_per_s2 == gravity_m_per_s2;
    const auto turning =
        static_cast<std::uint32_t>(std::ranges::count_if(servers, [](const auto& server) { return server.second; }));
    if (turning > 0 && turning == servers.size() && turning >= endpoints.writer<GravityRequest>().readers()) {
      log_info("gravity turns, says " + std::to_string(turning) + (turning == 1 ? " server" : " servers"));
      return;
    }
    std::this_thread::sleep_for(kTiltPollPeriod);
  }
  throw InputError("session '" + network.session +
                   "': " + (servers.empty() ? "no server was heard" : "a server did not turn gravity"));
}

}  // namespace sectio
