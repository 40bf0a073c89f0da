// Random numbers of tests. Each test has a seed of its own, and repeats itself. SECTIO_TEST_SEED moves all seeds at
// once, so that the same tests try other meshes, strokes and damages; a failure is repeated by the same number.
#pragma once

#include <cstdint>
#include <random>

#include "tests/support/environment.h"

namespace sectio::test {

inline std::uint64_t seeds_moved_by() {
  static const std::uint64_t by = number_from("SECTIO_TEST_SEED", 0);
  return by;
}

// The bound that a test with its own seed meets, or the one that others have met.
template <typename T>
T bound(T with_own_seed, T with_others) {
  return seeds_moved_by() == 0 ? with_own_seed : with_others;
}

template <typename Engine>
struct SeededRandom : Engine {
  explicit SeededRandom(std::uint64_t seed)
      : Engine(static_cast<typename Engine::result_type>(seed + seeds_moved_by())) {}
};

using Random = SeededRandom<std::mt19937>;
using Random64 = SeededRandom<std::mt19937_64>;

}  // namespace sectio::test
