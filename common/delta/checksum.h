// A checksum of the records of files: a damaged record is noticed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>

#include "common/math/hash.h"

namespace sectio {

inline std::uint64_t checksum(std::uint64_t seed, std::span<const std::uint8_t> bytes) {
  std::uint64_t h = hash_combine(mix64(seed), std::uint64_t{bytes.size()});
  for (std::size_t i = 0; i < bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min<std::size_t>(8, bytes.size() - i));
    h = hash_combine(h, word);
  }
  return h;
}

}  // namespace sectio
