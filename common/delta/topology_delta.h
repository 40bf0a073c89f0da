// A cut is a value. TopologyDelta holds the new content of every changed slot; apply() is the only code that changes a
// mesh. Replication, late join, undo of a temporary subdivision, recording and replay all use this mechanism.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct VertexEdit {
  VertexId id = kNone;
  bool alive = true;
  Vec3 rest_body_m = Vec3::Zero();
  bool operator==(const VertexEdit&) const = default;

  template <class A>
  void archive(A& a) {
    a(id, alive, rest_body_m);
  }
};

struct TriangleEdit {
  TriangleId id = kNone;
  Triangle triangle;  // dead: the slot is freed
  bool operator==(const TriangleEdit&) const = default;

  template <class A>
  void archive(A& a) {
    a(id, triangle);
  }
};

// Edits are in ascending order of slot, one a slot; each names the whole new content of its slot.
struct TopologyDelta {
  std::uint64_t base_revision = 0;
  std::uint64_t revision = 0;  // base_revision + 1; more for several deltas as one (merged_delta.h)
  std::uint64_t hash_after = 0;
  std::uint32_t vertex_slots_after = 0;
  std::uint32_t triangle_slots_after = 0;
  // Adds, moves or removes temporary elements of a deformation (paper A, 2.2); other deltas wait until there are none.
  bool temporary = false;
  std::vector<VertexEdit> vertices;
  std::vector<TriangleEdit> triangles;

  bool empty() const { return vertices.empty() && triangles.empty(); }
  bool operator==(const TopologyDelta&) const = default;

  template <class A>
  void archive(A& a) {
    a(base_revision, revision, hash_after, vertex_slots_after, triangle_slots_after, temporary, vertices, triangles);
  }
};

enum class ApplyStatus : std::uint8_t {
  applied,
  stale,          // revision <= that of the mesh: already known
  gap,            // base_revision > revision of the mesh: a delta is missing
  hash_mismatch,  // the result would not have hash_after
  malformed,      // slots out of range, not finite, not a closed manifold; permanent on top of temporary elements
};
const char* to_string(ApplyStatus status);

// Validates everything first, then changes the mesh; any status but `applied` leaves it untouched.
// Cost: O(size of the delta), independent of the size of the mesh.
[[nodiscard]] ApplyStatus apply(const TopologyDelta& delta, TriangleMesh& mesh);

// The delta that undoes `delta`, which must not have been applied to `before` yet. Applying it restores the database of
// `before` bit for bit (revision aside, which only grows).
TopologyDelta inverse(const TopologyDelta& delta, const TriangleMesh& before);

}  // namespace sectio
