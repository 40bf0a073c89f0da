// A Keyframe is the whole topology of one body at one revision. A viewer that joins late or has lost a delta starts
// from one, and a journal begins with one.
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
  std::uint64_t permanent_hash = 0;  // differs from hash while there are temporary elements
  std::vector<Vec3> rest_body_m;
  std::vector<std::uint8_t> vertex_alive;  // 0 or 1
  std::vector<Triangle> triangles;
  bool operator==(const Keyframe&) const = default;
};

Keyframe keyframe_of(const TriangleMesh& mesh);

// The header has 40 bytes, a vertex slot 25, a triangle slot 13.
std::vector<std::uint8_t> to_bytes(const Keyframe& keyframe);

// Returns nothing unless the size is exact, positions are finite, corners are in range and surfaces exist. Allocates at
// most a small multiple of bytes.size().
std::optional<Keyframe> keyframe_from_bytes(std::span<const std::uint8_t> bytes);

// Returns nothing unless the result is a closed manifold with the keyframe's hash. O(n log n).
std::optional<TriangleMesh> mesh_of(Keyframe keyframe);

// The same for deltas; apply() checks whether a delta fits a mesh.
std::vector<std::uint8_t> to_bytes(const TopologyDelta& delta);
std::optional<TopologyDelta> delta_from_bytes(std::span<const std::uint8_t> bytes);

}  // namespace sectio
