// The topology of a body's surface: a closed, oriented 2-manifold of triangles in slots.
//
// A slot is an index that stays with its vertex or triangle for life; a freed slot is dead until a later delta uses it
// again. Only apply() (common/delta/topology_delta.h) changes a mesh, on the server and in every replica.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/math/types.h"

namespace sectio {

using VertexId = std::uint32_t;
using TriangleId = std::uint32_t;
constexpr std::uint32_t kNone = 0xffffffffu;

// The kind of surface that a triangle belongs to; every split of the triangle keeps it.
enum class Surface : std::uint8_t {
  skin = 0,  // the organ's outside
  wall = 1,  // made by a cut: groove walls, bottoms and caps
};

// Corners in counter-clockwise order seen from outside. v[0] == kNone: the slot is dead.
struct Triangle {
  std::array<VertexId, 3> v{kNone, kNone, kNone};
  Surface surface = Surface::skin;

  bool alive() const { return v[0] != kNone; }
  int corner_of(VertexId x) const { return v[0] == x ? 0 : v[1] == x ? 1 : v[2] == x ? 2 : -1; }
  // The corners after and before this one, counter-clockwise.
  VertexId after(VertexId x) const { return v[static_cast<std::size_t>((corner_of(x) + 1) % 3)]; }
  VertexId before(VertexId x) const { return v[static_cast<std::size_t>((corner_of(x) + 2) % 3)]; }
  bool operator==(const Triangle&) const = default;

  template <class A>
  void archive(A& a) {
    a(v, surface);
  }
};

// Triangles as they come from a file: welded, indices into vertices_body_m.
struct TriangleSoup {
  std::vector<Vec3> vertices_body_m;
  std::vector<std::array<VertexId, 3>> triangles;
};

// The triangles around a vertex, counter-clockwise seen from outside, from incident(v) on; empty at a dead vertex. A
// view of any mesh with incident(), triangle() and neighbour(): valid until the mesh changes.
template <class Mesh>
class TriangleFan {
 public:
  struct End {};
  class Iterator {
   public:
    Iterator(const Mesh& mesh, VertexId v) : mesh_(&mesh), v_(v), first_(mesh.incident(v)), t_(first_) {}

    TriangleId operator*() const { return t_; }
    Iterator& operator++() {
      t_ = mesh_->neighbour(t_, (mesh_->triangle(t_).corner_of(v_) + 2) % 3);
      if (t_ == first_) t_ = kNone;
      return *this;
    }
    bool operator==(End) const { return t_ == kNone; }

   private:
    const Mesh* mesh_;
    VertexId v_;
    TriangleId first_, t_;
  };

  TriangleFan(const Mesh& mesh, VertexId v) : mesh_(mesh), v_(v) {}

  Iterator begin() const { return {mesh_, v_}; }
  End end() const { return {}; }

 private:
  const Mesh& mesh_;
  VertexId v_;
};

class TriangleMesh {
 public:
  TriangleMesh() = default;

  // Requires a closed, oriented manifold without unreferenced vertices (see check_soup()); throws InputError otherwise.
  explicit TriangleMesh(const TriangleSoup& soup);

  // Rebuilds a mesh from its slots, dead ones included (keyframes). Dead vertices have alive[v] == 0.
  // permanent_hash: none if there are no temporary elements.
  TriangleMesh(std::vector<Vec3> rest_body_m, std::vector<std::uint8_t> vertex_alive, std::vector<Triangle> triangles,
               std::uint64_t revision, std::optional<std::uint64_t> permanent_hash = {});

  std::uint32_t vertex_slots() const { return static_cast<std::uint32_t>(rest_.size()); }
  std::uint32_t triangle_slots() const { return static_cast<std::uint32_t>(triangles_.size()); }
  std::uint32_t vertex_count() const { return vertex_slots() - static_cast<std::uint32_t>(free_vertices_.size()); }
  std::uint32_t triangle_count() const { return triangle_slots() - static_cast<std::uint32_t>(free_triangles_.size()); }

  bool vertex_alive(VertexId v) const { return incident_[v] != kNone; }
  const Vec3& rest_body_m(VertexId v) const { return rest_[v]; }
  const Triangle& triangle(TriangleId t) const { return triangles_[t]; }
  // The triangle across the edge v[i] -> v[(i + 1) % 3].
  TriangleId neighbour(TriangleId t, int i) const { return neighbours_[t][static_cast<std::size_t>(i)]; }
  const std::array<TriangleId, 3>& neighbours(TriangleId t) const { return neighbours_[t]; }
  // Some triangle at v; kNone for a dead slot.
  TriangleId incident(VertexId v) const { return incident_[v]; }
  TriangleFan<TriangleMesh> fan(VertexId v) const { return {*this, v}; }

  // Dead slots in ascending order.
  std::span<const VertexId> free_vertices() const { return free_vertices_; }
  std::span<const TriangleId> free_triangles() const { return free_triangles_; }

  std::span<const Vec3> rest_body_m() const { return rest_; }
  std::span<const Triangle> triangles() const { return triangles_; }

  // The hash of slot numbers, rest positions (bit for bit), corners and surfaces; not of the revision.
  std::uint64_t hash() const { return hash_; }
  std::uint64_t revision() const { return revision_; }
  // The hash without the temporary elements of a deformation (TopologyDelta::temporary): there are none when the two
  // hashes are equal.
  std::uint64_t permanent_hash() const { return permanent_hash_; }
  bool has_temporary_elements() const { return hash_ != permanent_hash_; }

  std::size_t bytes() const;  // memory held, spare capacity included

  // Compares all slots, dead ones included, but not adjacency, which is derived.
  bool same_database(const TriangleMesh& other) const;

  template <class A>
  void archive(A& a) {
    a(rest_, triangles_, neighbours_, incident_, free_vertices_, free_triangles_, hash_, permanent_hash_, revision_);
  }

 private:
  friend class MeshWriter;  // common/delta/apply.cpp

  void rebuild_derived();

  std::vector<Vec3> rest_;
  std::vector<Triangle> triangles_;
  std::vector<std::array<TriangleId, 3>> neighbours_;
  std::vector<TriangleId> incident_;
  std::vector<VertexId> free_vertices_;
  std::vector<TriangleId> free_triangles_;
  std::uint64_t hash_ = 0;
  std::uint64_t permanent_hash_ = 0;
  std::uint64_t revision_ = 0;
};

std::uint64_t vertex_hash(VertexId v, const Vec3& rest_body_m);
std::uint64_t triangle_hash(TriangleId t, const Triangle& triangle);
// Slot counts are part of the hash of a mesh: a database with one more dead slot is another database.
std::uint64_t slots_hash(std::uint32_t vertex_slots, std::uint32_t triangle_slots);

}  // namespace sectio
