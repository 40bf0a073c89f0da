#include "sim_server/net/tilt.h"

#include <chrono>
#include <map>
#include <thread>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/dds/convert.h"
#include "common/dds/endpoint.h"

namespace sectio {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPollPeriod = std::chrono::milliseconds(20);

std::uint64_t source_now() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count());
}

}  // namespace

void request_gravity(const NetworkOptions& network, const Vec3& gravity_m_per_s2, double patience_s) {
  Participant participant(network, "sim_server tilt");
  Writer<wire::GravityRequest> writer(participant);
  Reader<wire::ServerStatus> status_reader(participant);
  const GravityRequest request{source_now(), gravity_m_per_s2};
  if (!from_wire(to_wire(request))) throw InputError("--gravity: expected at most 100 m/s2");
  if (!writer.write(to_wire(request))) throw InputError("tilt: DDS refused to send the request");

  std::map<std::uint64_t, bool> servers;  // by epoch: does it turn there?
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
  while (Clock::now() < until) {
    wire::ServerStatus message;
    while (status_reader.take(message))
      if (const std::optional<ServerStatus> status = from_wire(message))
        servers[status->epoch] = status->gravity_target_m_per_s2 == gravity_m_per_s2;
    const auto turning =
        static_cast<std::uint32_t>(std::ranges::count_if(servers, [](const auto& server) { return server.second; }));
    if (turning > 0 && turning == servers.size() && turning >= writer.readers()) {
      log_info("gravity turns, says " + std::to_string(turning) + (turning == 1 ? " server" : " servers"));
      return;
    }
    std::this_thread::sleep_for(kPollPeriod);
  }
  throw InputError("session '" + network.session +
                   "': " + (servers.empty() ? "no server was heard" : "a server did not turn gravity"));
}

}  // namespace sectio
