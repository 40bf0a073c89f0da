// The epoch of a server: the beginning of its session, in units of 256 microseconds since 1970, times 2^20, plus the
// term.
//
// The beginning is a name, made unique by a clock; nobody compares the clocks of two sessions. Each server that takes
// the session over, after a fault or in place of another, counts the term up by one: of two servers with one beginning
// the one with the later term holds the session, and the other is a ghost. A session that is begun anew, or a record
// that is shown from another moment, has another term, too: there are enough for 200 000 of these.
#pragma once

#include <cstdint>
#include <random>

#include "common/core/wall_time.h"

namespace sectio {

constexpr unsigned kTermBits = 20;

constexpr std::uint64_t first_epoch(std::uint64_t beginning) {
  return beginning << kTermBits;
}
inline std::uint64_t new_epoch() {
  return first_epoch(microseconds_since_1970() >> 8);
}
constexpr std::uint64_t beginning_of(std::uint64_t epoch) {
  return epoch >> kTermBits;
}
constexpr bool same_session(std::uint64_t epoch, std::uint64_t other) {
  return beginning_of(epoch) == beginning_of(other);
}
// The epoch of a server that takes the session over. Two that do so at once, without knowing of each other, have
// different terms almost always; the later one stays.
inline std::uint64_t next_term(std::uint64_t epoch) {
  return epoch + 1 + std::random_device{}() % 8;
}
// `later` holds the session that `epoch` had before.
constexpr bool takes_over(std::uint64_t later, std::uint64_t epoch) {
  return same_session(later, epoch) && later > epoch;
}

}  // namespace sectio
