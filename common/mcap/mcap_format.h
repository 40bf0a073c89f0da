// The records of MCAP files that this project writes or reads (https://mcap.dev/spec).
#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <span>

namespace sectio {

constexpr std::array<std::uint8_t, 8> kMcapMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum class McapOp : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15,
};

// The checksum of a chunk's records before they are compressed.
inline std::uint32_t mcap_crc(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
}

}  // namespace sectio
