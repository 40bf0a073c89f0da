// The epoch of a server: the name of its session times 2^20, plus the term.
//
// The name is the second in which the session began, modulo 2^27, times 2^16, plus a random number, so that servers
// that start in one moment differ. Each server that takes the session over, after a fault or in place of another,
// counts the term up by one: of two servers with one name the one with the later term holds the session, and the other
// is a ghost. A session that is begun anew, or a record that is shown from another moment, has another term, too: there
// are enough for 200 000 of these.
#pragma once

#include <cstdint>
#include <random>

#include "common/core/unique_id.h"
#include "common/core/wall_time.h"

namespace sectio {

constexpr unsigned kTermBits = 20;

constexpr std::uint64_t first_epoch(std::uint64_t name_of_session) {
  return name_of_session << kTermBits;
}
inline std::uint64_t new_epoch() {
  const std::uint64_t second = microseconds_since_1970() / 1'000'000 % (1u << 27);
  return first_epoch(second << 16 | unique_id(16));
}
constexpr std::uint64_t name_of_session(std::uint64_t epoch) {
  return epoch >> kTermBits;
}
constexpr bool same_session(std::uint64_t epoch, std::uint64_t other) {
  return name_of_session(epoch) == name_of_session(other);
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
