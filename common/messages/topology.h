// Changes of topology on their way to viewers, as plain values (idl/topology.idl).
#pragma once

#include <cstdint>
#include <vector>

#include "common/delta/topology_delta.h"

namespace sectio {

struct DeltaMessage {
  std::uint64_t epoch = 0;
  std::uint32_t body_id = 0;
  TopologyDelta delta;
};

// A piece of the bytes of a Keyframe (common/delta/keyframe.h).
struct KeyframeChunk {
  std::uint64_t epoch = 0;
  std::uint32_t body_id = 0;
  std::uint64_t revision = 0;
  std::uint64_t total_bytes = 0;
  std::uint32_t chunk = 0;
  std::uint32_t chunks = 1;
  std::vector<std::uint8_t> bytes;
};

constexpr std::uint64_t kNoRevision = ~std::uint64_t{0};

struct KeyframeRequest {
  std::uint64_t epoch = 0;
  std::uint32_t body_id = 0;
  std::uint64_t known_revision = kNoRevision;
  std::uint64_t client = 0;
};

}  // namespace sectio
