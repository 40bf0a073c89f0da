// 64-bit hashing of topology. Element hashes are summed modulo 2^64, so that a change of k elements changes the
// hash of the whole in O(k): nothing that a cut does touches the whole mesh.
#pragma once

#include <bit>
#include <cstdint>

namespace sectio {

// The finaliser of splitmix64: a bijection with full avalanche.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

constexpr std::uint64_t hash_combine(std::uint64_t seed, std::uint64_t value) {
  return mix64(seed ^ mix64(value));
}

inline std::uint64_t hash_combine(std::uint64_t seed, double value) {
  return hash_combine(seed, std::bit_cast<std::uint64_t>(value));
}

}  // namespace sectio
