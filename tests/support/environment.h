// Numbers that somebody who runs tests may set.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace sectio::test {

inline std::uint64_t number_from(const char* variable, std::uint64_t usual) {
  const char* const text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : usual;
}

}  // namespace sectio::test
