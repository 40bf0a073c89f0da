#include "tests/support/dds_session.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace sectio::test {

namespace {

constexpr std::uint32_t kDomains = 100;

// A lock that lives as long as this process keeps the tests that run beside it off the domain.
bool is_taken(std::uint32_t domain) {
  const std::string file = std::filesystem::temp_directory_path() / ("sectio_test_domain_" + std::to_string(domain));
  const int lock = ::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
  if (lock >= 0 && ::flock(lock, LOCK_EX | LOCK_NB) == 0) return false;
  if (lock >= 0) ::close(lock);
  return true;
}

}  // namespace

NetworkOptions own_session() {
  static std::uint32_t count = 0;
  NetworkOptions options;
  for (std::uint32_t k = 0; k < kDomains; ++k) {
    options.domain = 1 + (static_cast<std::uint32_t>(getpid()) * 7 + count + k) % kDomains;
    if (!is_taken(options.domain)) break;
  }
  options.session = "test-" + std::to_string(getpid()) + "-" + std::to_string(count++);
  return options;
}

}  // namespace sectio::test
