// A domain and a session of its own for each test, on loopback: tests of one machine may run at the same time. Domains
// up to 100 keep clear of the ports that the system gives away.
#pragma once

#include <unistd.h>

#include <string>

#include "common/dds/participant.h"

namespace sectio::test {

inline NetworkOptions own_session() {
  static std::uint32_t count = 0;
  NetworkOptions options;
  options.domain = 1 + (static_cast<std::uint32_t>(getpid()) * 7 + count) % 100;
  options.session = "test-" + std::to_string(getpid()) + "-" + std::to_string(count++);
  return options;
}

}  // namespace sectio::test
