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

// Puts chunks together again, in any order. Holds one revision of each body, the one that came last, so that memory is
// bounded by bodies x keyframe. Allocates no more than has arrived, beside the table of chunks.
class KeyframeAssembler {
 public:
  // The whole keyframe when this chunk was the last one missing. A chunk that contradicts the first one seen of its
  // revision is dropped. Expects a valid chunk (validate.h).
  std::optional<std::vector<std::uint8_t>> add(KeyframeChunk chunk);

  // Forgets everything, for another server.
  void clear() { parts_.clear(); }

 private:
  struct Parts {
    std::uint64_t revision = 0;
    std::uint64_t total_bytes = 0;
    std::uint32_t missing = 0;
    std::vector<std::vector<std::uint8_t>> chunks;
  };
  std::map<std::uint32_t, Parts> parts_;  // by body_id
};

}  // namespace sectio
