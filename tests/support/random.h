// Random numbers of tests. Each test has a seed of its own, and repeats itself. SECTIO_TEST_SEED moves all seeds at
// once, so that the same tests try other meshes, strokes and damages; a failure is repeated by the same number.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>

namespace sectio::test {

inline std::uint64_t seeds_moved_by() {
  static const char* const given = std::getenv("SECTIO_TEST_SEED");
  static const std::uint64_t by = given ? std::strtoull(given, nullptr, 10) : 0;
  return by;
}

template <typename Engine>
struct SeededRandom : Engine {
  explicit SeededRandom(std::uint64_t seed)
      : Engine(static_cast<typename Engine::result_type>(seed + seeds_moved_by())) {}
};

using Random = SeededRandom<std::mt19937>;
using Random64 = SeededRandom<std::mt19937_64>;

}  // namespace sectio::test
