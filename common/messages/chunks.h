// A keyframe travels in chunks.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/messages/topology.h"

namespace sectio {

// `bytes` must not be empty.
std::vector<KeyframeChunk> split_keyframe(std::uint64_t epoch, std::uint32_t body_id, std::uint64_t revision,
                                          std::span<const std::uint8_t> bytes, std::uint32_t chunk_bytes);

// Puts chunks together again, in any order. Holds one revision of each body, the one that came last. Allocates no more
// than has arrived.
class KeyframeAssembler {
 public:
  // The whole keyframe when this chunk was the last one missing. A chunk that contradicts the first one seen of its
  // revision is dropped. Expects a valid chunk (validate.h).
  std::optional<std::vector<std::uint8_t>> add(KeyframeChunk chunk);

  bool has(std::uint32_t body_id) const { return parts_.contains(body_id); }
  // The first chunk of the body that hasn't come; it must have some.
  std::uint32_t first_missing(std::uint32_t body_id) const;
  void forget(std::uint32_t body_id);
  std::size_t bytes() const { return bytes_; }  // all chunks, with their places

 private:
  struct Parts {
    std::uint64_t revision = 0;
    std::uint64_t total_bytes = 0;
    std::uint32_t count = 0;
    std::size_t bytes = 0;
    std::map<std::uint32_t, std::vector<std::uint8_t>> chunks;
  };
  static constexpr std::size_t kPlaceBytes = 96;  // memory that the map needs for a chunk

  std::map<std::uint32_t, Parts> parts_;  // by body_id
  std::size_t bytes_ = 0;
};

}  // namespace sectio
