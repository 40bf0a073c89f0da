// Messages that carry changes of topology to viewers (idl/topology.idl).
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

constexpr std::uint32_t kChunkBytes = 1 << 15;      // loopback: half of a datagram
constexpr std::uint32_t kChunkBytesOffHost = 1100;  // one packet with its headers
constexpr std::uint64_t kMaxKeyframeBytes = 1ull << 28;
constexpr std::uint32_t kMaxChunks = 1u << 18;

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
constexpr std::uint32_t kFirstWindow = 16;   // chunks
constexpr std::uint32_t kMostWindow = 1024;  // chunks

// A keyframe is pulled in windows, so that no link is given more than it bears. The first request names no revision,
// and is answered with the first chunks of a new one; the others name that revision and the chunks that are to follow.
struct KeyframeRequest {
  std::uint64_t epoch = 0;
  std::uint32_t body_id = 0;
  std::uint64_t known_revision = kNoRevision;
  std::uint64_t client = 0;
  std::uint64_t revision = kNoRevision;  // the keyframe that is being pulled
  std::uint32_t first_chunk = 0;
  std::uint32_t chunks = kFirstWindow;
};

}  // namespace sectio
