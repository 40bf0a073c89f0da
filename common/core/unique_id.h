// A name for something that begins: a program's start, an order, a session.
#pragma once

#include <cstdint>
#include <random>

namespace sectio {

// A random number of so many bits, at most 64, and never 0. Programs that start in the same moment differ.
inline std::uint64_t unique_id(unsigned bits) {
  std::random_device chance;
  for (;;) {
    const std::uint64_t id = (std::uint64_t{chance()} << 32 | chance()) >> (64 - bits);
    if (id != 0) return id;
  }
}

constexpr unsigned kProgramIdBits = 53;  // a browser's numbers hold them

}  // namespace sectio
