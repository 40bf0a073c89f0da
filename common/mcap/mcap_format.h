// The records of MCAP files that this project writes or reads (https://mcap.dev/spec).
#pragma once

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

// The checksum of a chunk's records before they are compressed: CRC-32 of IEEE 802.3, as zlib has it.
inline std::uint32_t mcap_crc(std::span<const std::uint8_t> bytes) {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> rests{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      rests[i] = i;
      for (int bit = 0; bit < 8; ++bit) rests[i] = rests[i] >> 1 ^ (rests[i] & 1 ? 0xedb88320u : 0);
    }
    return rests;
  }();
  std::uint32_t crc = 0xffffffffu;
  for (const std::uint8_t byte : bytes) crc = crc >> 8 ^ table[(crc ^ byte) & 0xff];
  return ~crc;
}

}  // namespace sectio
