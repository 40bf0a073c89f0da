// Numbers that look random and are the same everywhere. A power iteration starts from them, as no mode is likely to be
// orthogonal to such a vector.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/math/types.h"

namespace sectio {

// A number in [-1, 1).
inline double fixed_sequence(std::size_t n) {
  std::uint64_t x = (n + 1) * 0x9e3779b97f4a7c15u;
  x ^= x >> 29;
  x *= 0xbf58476d1ce4e5b9u;
  x ^= x >> 32;
  return static_cast<double>(x & 0xffffff) / 0x800000 - 1;
}

inline Vec3 fixed_vector(std::size_t n) {
  return {fixed_sequence(3 * n), fixed_sequence(3 * n + 1), fixed_sequence(3 * n + 2)};
}

}  // namespace sectio
