// The epoch of a server: the name of its session times 2^20, plus the term.
//
// The name is the second in which the session began, modulo 2^27, times 2^16, plus a hash of that and of the program
// that began it. So servers that start in one moment differ, and whoever comes later can tell the program that began a
// session from one that speaks in its name. Each server that takes the session over, after a fault or in place of
// another, counts the term up by one: of two servers with one name the one with the later term holds the session, and
// the other is a ghost. A session that is begun anew, or a record that is shown from another moment, has another term,
// too: there are enough for 200 000 of these.
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "common/core/wall_time.h"
#include "common/math/hash.h"

namespace sectio {

// A program on the wire: the prefix of the identities (GUID) of all its writers.
using ProgramId = std::array<std::uint8_t, 12>;

constexpr unsigned kTermBits = 20;

constexpr std::uint64_t first_epoch(std::uint64_t name_of_session) {
  return name_of_session << kTermBits;
}
constexpr std::uint64_t hash_of(const ProgramId& program, std::uint64_t hash = 0) {
  for (const std::uint8_t byte : program) hash = hash_combine(hash, std::uint64_t{byte});
  return hash;
}
constexpr std::uint64_t name_begun_by(const ProgramId& program, std::uint64_t second) {
  return second << 16 | hash_of(program, second) >> 48;
}
inline std::uint64_t new_epoch(const ProgramId& own) {
  return first_epoch(name_begun_by(own, microseconds_since_1970() / 1'000'000 % (1u << 27)));
}
constexpr std::uint64_t name_of_session(std::uint64_t epoch) {
  return epoch >> kTermBits;
}
// The program began the session, as one in 65 536 others might have.
constexpr bool has_begun(const ProgramId& program, std::uint64_t epoch) {
  const std::uint64_t name = name_of_session(epoch);
  return name == name_begun_by(program, name >> 16);
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
