// Clocks that several rooms read.
#pragma once

#include <chrono>
#include <cstdint>

namespace sectio {

inline std::uint64_t microseconds_since_1970() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count());
}

// Seconds of a clock that never goes back, from an arbitrary beginning.
inline double steady_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace sectio
