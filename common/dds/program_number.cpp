#include "common/dds/program_number.h"

#include <fastdds/rtps/common/PortParameters.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <optional>
#include <string>

#include "common/core/error.h"
#include "common/core/log.h"

namespace sectio {
namespace {

// Whether a program of this host could listen there.
bool is_free(std::uint16_t udp_port) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return true;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(udp_port);
  const bool free = bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(socket);
  return free;
}

// A socket whose name, in the abstract namespace, belongs to one program of a host; -1 where programs may not have such
// sockets. Nothing: another program has it.
std::optional<int> reserve(std::uint32_t domain, std::uint32_t number) {
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return socket;
  const std::string name = "sectio domain " + std::to_string(domain) + " program " + std::to_string(number);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path + 1, sizeof address.sun_path - 1);  // after a zero, which makes the name abstract
  const std::size_t size = offsetof(sockaddr_un, sun_path) + 1 + name.size();
  const auto* const named = reinterpret_cast<const sockaddr*>(&address);
  if (bind(socket, named, static_cast<socklen_t>(size)) == 0 || errno != EADDRINUSE) return socket;
  close(socket);
  return std::nullopt;
}

void release(int reservation) {
  if (reservation >= 0) close(reservation);
}

}  // namespace

ProgramNumber::ProgramNumber(const NetworkOptions& options) {
  // A process counts up, so that its participants have different numbers in all domains.
  static std::atomic<std::uint32_t> count{0};
  const std::uint32_t first = count++;
  const eprosima::fastrtps::rtps::PortParameters ports;
  for (std::uint32_t i = 0; i < kProgramsOnHost; ++i) {
    // Numbers that other hosts look for come first.
    const bool looked_for = options.off_host() && i < kProgramsTriedOffHost;
    const std::uint32_t number = looked_for           ? (first + i) % kProgramsTriedOffHost
                                 : options.off_host() ? i
                                                      : (first + i) % kProgramsOnHost;
    const std::uint32_t port =
        ports.portBase + ports.domainIDGain * options.domain + ports.offsetd1 + ports.participantIDGain * number;
    if (port + 1 > UINT16_MAX) continue;
    const std::optional<int> reservation = reserve(options.domain, number);
    if (!reservation) continue;
    if (!is_free(static_cast<std::uint16_t>(port))) {
      release(*reservation);
      continue;
    }
    if (options.off_host() && number >= kProgramsTriedOffHost)
      log_limited(LogLevel::warning, "many programs",
                  "this is program " + std::to_string(number + 1) + " of domain " + std::to_string(options.domain) +
                      " on this host: it meets only the first " + std::to_string(kProgramsTriedOffHost) +
                      " programs of each other host");
    value_ = static_cast<std::int32_t>(number);
    reservation_ = *reservation;
    return;
  }
  throw InputError("--domain " + std::to_string(options.domain) + ": " + std::to_string(kProgramsOnHost) +
                   " programs of this host are on it, and no more can find each other");
}

ProgramNumber::~ProgramNumber() {
  release(reservation_);
}

}  // namespace sectio
