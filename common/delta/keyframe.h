// A Keyframe is the whole topology of one body at one revision: what a viewer that joins late, or that has lost a
// delta, starts again from; and the beginning of a journal.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/delta/topology_delta.h"

namespace sectio {

// One entry a slot, dead ones included. Rest positions of dead vertices are zero: they are not part of the database.
struct Keyframe {
  std::uint64_t revision = 0;
  std::uint64_t hash = 0;
  std::uint64_t permanent_hash = 0;  // another one while temporary elements are there
  std::vector<Vec3> rest_body_m;
  std::vector<std::uint8_t> vertex_alive;  // 0 or 1
  std::vector<Triangle> triangles;
  bool operator==(const Keyframe&) const = default;
};

Keyframe keyframe_of(const TriangleMesh& mesh);

// 40 bytes of header, 25 a vertex slot, 13 a triangle slot.
std::vector<std::uint8_t> to_bytes(const Keyframe& keyframe);

// Nothing unless the size is exact, positions are finite, corners are in range and surfaces exist. Allocates no more
// than a small multiple of bytes.size().
std::optional<Keyframe> keyframe_from_bytes(std::span<const std::uint8_t> bytes);

// Nothing unless the result is a closed manifold with the keyframe's hash. O(n log n).
std::optional<TriangleMesh> mesh_of(Keyframe keyframe);

// The same for deltas; validity against a mesh is for apply() to judge.
std::vector<std::uint8_t> to_bytes(const TopologyDelta& delta);
std::optional<TopologyDelta> delta_from_bytes(std::span<const std::uint8_t> bytes);

}  // namespace sectio
