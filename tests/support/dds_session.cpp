#include "tests/support/dds_session.h"

#include <unistd.h>
#include <string>

namespace sectio::test {

NetworkOptions own_session() {
  static std::uint32_t count = 0;
  NetworkOptions options;
  options.domain = 1 + (static_cast<std::uint32_t>(getpid()) * 7 + count) % 100;
  options.session = "test-" + std::to_string(getpid()) + "-" + std::to_string(count++);
  return options;
}

}  // namespace sectio::test
