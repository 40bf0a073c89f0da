// A draft of changes to a mesh: reads fall through to the mesh, writes stay in the draft until delta() sums them up.
// Planning a cut is therefore a pure function, and a refused cut is a draft that is dropped.
//
// The draft also holds the state (world position and velocity) of vertices that it adds or moves, because later changes
// in the same step need them.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "common/delta/topology_delta.h"
#include "sim_server/bodies/particle_state.h"

namespace sectio {

struct VertexState {
  Vec3 rest_body_m = Vec3::Zero();
  Vec3 position_world_m = Vec3::Zero();
  Vec3 velocity_world_m_per_s = Vec3::Zero();

  // The same linear combination of all three members.
  static VertexState mix(const VertexState& a, const VertexState& b, double s);
  static VertexState mix(const std::array<VertexState, 3>& corners, const Vec3& bary);

  template <class A>
  void archive(A& a) {
    a(rest_body_m, position_world_m, velocity_world_m_per_s);
  }
};

class MeshDraft {
 public:
  MeshDraft(const TriangleMesh& base, ParticleView particles) : base_(&base), particles_(particles) {
    vertex_slots_ = base.vertex_slots();
    triangle_slots_ = base.triangle_slots();
  }

  Triangle triangle(TriangleId t) const;
  TriangleId neighbour(TriangleId t, int i) const;
  TriangleId incident(VertexId v) const;  // kNone: dead
  VertexState state(VertexId v) const;
  Vec3 position(VertexId v) const { return state(v).position_world_m; }
  Vec3 rest(VertexId v) const;

  // The triangles around v, counter-clockwise from any of them on. Empty if v is dead.
  std::vector<TriangleId> fan(VertexId v) const;
  // The triangle that has the directed edge from -> to; kNone if there is none.
  TriangleId triangle_of_edge(VertexId from, VertexId to) const;
  // The triangle with these corners in this cyclic order; kNone if there is none.
  TriangleId find_triangle(VertexId a, VertexId b, VertexId c) const;

  // Appends the triangles that the draft has changed and that are alive.
  void append_edited(std::vector<TriangleId>& triangles) const {
    for (const auto& [t, record] : triangles_)
      if (record.triangle.alive()) triangles.push_back(t);
  }

  // Uses the lowest free slot. A vertex that returns to its slot with the same rest position keeps its former state.
  VertexId add_vertex(const VertexState& state);
  void move_vertex(VertexId v, const VertexState& state);

  // Replaces triangles; new ones take the slots of old ones, then free slots. Vertices that lose their last triangle
  // die. False when the hole is not filled exactly; the draft must then be dropped.
  [[nodiscard]] bool replace(std::span<const TriangleId> removed, std::span<const Triangle> added);

  // Undoes an earlier delta, given its inverse.
  [[nodiscard]] bool undo(const TopologyDelta& inverse);

  // From mark() on the draft records what it overwrites; inverse_since_mark() undoes all of it.
  void mark();
  TopologyDelta inverse_since_mark() const;

  // The difference to the mesh; empty() if there is none.
  TopologyDelta delta() const;
  // The states to set once the delta is applied, in ascending order of slot.
  std::vector<std::pair<VertexId, VertexState>> seeds() const;

 private:
  struct TriangleRecord {
    Triangle triangle;
    std::array<TriangleId, 3> neighbours{kNone, kNone, kNone};
  };
  struct VertexRecord {
    VertexState state;
    TriangleId incident = kNone;
    bool set = false;  // rest position or state were set here
  };

  TriangleRecord& edit_triangle(TriangleId t);
  VertexRecord& edit_vertex(VertexId v);
  std::uint32_t take_slot(std::set<std::uint32_t>& freed, std::size_t& cursor, std::span<const std::uint32_t> base_free,
                          std::uint32_t& slots);
  void remember(VertexId v);
  bool exchange(const std::map<TriangleId, Triangle>& after);

  const TriangleMesh* base_;
  ParticleView particles_;
  std::uint32_t vertex_slots_ = 0;
  std::uint32_t triangle_slots_ = 0;
  std::map<TriangleId, TriangleRecord> triangles_;
  std::map<VertexId, VertexRecord> vertices_;
  std::set<std::uint32_t> freed_vertices_, freed_triangles_;
  std::size_t vertex_cursor_ = 0, triangle_cursor_ = 0;

  bool marked_ = false;
  std::uint32_t vertex_slots_at_mark_ = 0, triangle_slots_at_mark_ = 0;
  std::map<VertexId, std::optional<Vec3>> vertices_at_mark_;  // rest position; nothing: the slot was dead
  std::map<TriangleId, Triangle> triangles_at_mark_;
};

// The unit normal of a triangle with these corners at rest, out of the tissue.
Vec3 rest_normal_of(const MeshDraft& draft, const std::array<VertexId, 3>& corners);

}  // namespace sectio
