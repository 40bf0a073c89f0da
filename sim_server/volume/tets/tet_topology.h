// A volume whose tetrahedra change: two operations, each with an exact inverse, from which every cut is made. Both keep
// the mesh conforming: tetrahedra meet in whole faces or not at all. A journal of operations can be taken back as one
// value, a TetDelta, and be applied again.
//
//   split   an edge a b at n: each tetrahedron (.. a b ..) becomes (.. a n ..), and (.. n b ..) is new
//   part    a vertex v gets a twin: some of the tetrahedra at v have the twin instead
//
// A copy is cheap, and serves as a draft: it shares what it doesn't change.
//
// State is interpolated along the edge, rest position, position and velocity alike: a linear field stays what it was,
// so that deformation, momentum (with masses by volume) and the energy of each element are unchanged.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/core/shared_pages.h"
#include "common/mesh/tet_mesh.h"
#include "sim_server/volume/tets/tet_delta.h"

namespace sectio {

struct TetVertexState {
  Vec3 rest_body_m = Vec3::Zero();
  Vec3 position_world_m = Vec3::Zero();
  Vec3 velocity_m_per_s = Vec3::Zero();

  template <class A>
  void archive(A& a) {
    a(rest_body_m, position_world_m, velocity_m_per_s);
  }
};

class TetTopology {
 public:
  // Begins at rest, in the mesh's own place.
  explicit TetTopology(const TetMesh& mesh);

  std::size_t vertex_count() const { return vertices_.size(); }
  const TetVertexState& vertex(VertexId v) const {
    if (source_ && v < fetchable_ && fetched_[v] != fetch_) fetch(v);
    return vertices_[v];
  }
  void set_state(VertexId v, const Vec3& position_world_m, const Vec3& velocity_m_per_s);
  // From now on the states of the present vertices come from `source`, each when it is first asked for: a cut looks at
  // few. Vertices that an operation makes after this have states of their own. An empty source: states stay as they
  // are.
  using StateOf = std::function<TetVertexState(VertexId v)>;
  void fetch_states_from(StateOf source);
  const SharedPages<Tetrahedron, 64>& tetrahedra() const { return tets_; }
  std::span<const std::uint32_t> star(VertexId v) const { return star_[v]; }
  double volume_m3(std::uint32_t t) const;  // at rest
  double face_m2(VertexId a, VertexId b, VertexId c) const;
  bool alive(VertexId v) const { return !star_[v].empty(); }
  // The tetrahedron beyond the face opposite a corner; kNone at the surface. O(star).
  std::uint32_t across(std::uint32_t t, std::size_t corner) const;
  // All tetrahedra that faces connect with these, ascending. O(result).
  std::vector<std::uint32_t> connected(std::vector<std::uint32_t> tetrahedra) const;
  // At rest, without numbers that are not used any more.
  TetMesh mesh() const;

  // Splits the edge at a + t (b - a), 0 < t < 1. Returns the new vertex, the highest number. O(star).
  VertexId split(VertexId a, VertexId b, double t);
  // Gives v a twin. `of`: tetrahedra at v, some but not all. Returns the twin, the highest number. O(star).
  VertexId part(VertexId v, std::span<const std::uint32_t> of);

  // Operations so far; undo_to() undoes those after a mark, last first: vertices, tetrahedra and the order of stars are
  // what they were, to the bit. Vertices that are left keep the state that they have; one that had a twin goes to the
  // middle of the two by mass.
  std::size_t mark() const { return journal_.size(); }
  void undo_to(std::size_t mark);
  // The same, and the operations as a value.
  TetDelta take_back(std::size_t mark = 0);
  // Operations so far can't be undone any more.
  void forget();
  // The sum of the operations after a mark. O(operations).
  TetChange change(std::size_t mark = 0) const;
  // Removes these tetrahedra, and vertices that have no other. There are no operations to undo.
  TetChange remove(std::span<const std::uint32_t> tetrahedra);
  // A vertex moves onto its neighbour: the tetrahedra with both are gone, the others at v have the neighbour instead.
  // See judge_collapse() for when this leaves a mesh. There are no operations to undo. collapse_change(): the same
  // change, not made.
  TetChange collapse(VertexId v, VertexId onto);
  TetChange collapse_change(VertexId v, VertexId onto) const;
  // The vertices that an operation has made a vertex from: the ends of its edge, or the vertex whose twin it is, twice.
  // Nothing for a vertex that is older than the operations.
  std::optional<std::array<VertexId, 2>> made_from(VertexId v) const;
  // Scratch table for algorithms on the volume: by vertex, to be left all 0.
  std::vector<std::uint32_t>& scratch() { return scratch_.by_vertex; }

  template <class A>
  void archive(A& a) {
    a(vertices_, tets_, star_, journal_, vertices_before_, tets_before_);
  }

 private:
  struct Operation {
    VertexId a = kNone, b = kNone;  // split: the edge; part: a, and b is kNone
    VertexId made = kNone;
    double t = 0;
    std::vector<std::uint32_t> tets;   // split: those that had the edge; part: the star of a before
    std::vector<Tetrahedron> corners;  // their corners before
    std::vector<std::uint32_t> of;     // part: those that have the twin

    template <class A>
    void archive(A& ar) {
      ar(a, b, made, t, tets, corners, of);
    }
  };
  friend void apply(const TetDelta& delta, TetTopology& volume);
  std::size_t tets_at(std::size_t mark) const;
  double twin_share(const Operation& part) const;
  void undo_split(const Operation& operation);
  void undo_part(const Operation& operation);
  double volume_at(VertexId v) const;
  void fetch(VertexId v) const;

  // A copy begins with tables of its own.
  struct Scratch {
    Scratch() = default;
    Scratch(const Scratch&) {}
    Scratch& operator=(const Scratch&) { return *this; }
    std::vector<std::uint32_t> by_vertex, seen;  // by tetrahedron: the round that saw it last
    std::uint32_t round = 0;
  };

  StateOf source_;
  std::uint32_t fetch_ = 0;
  mutable SharedPages<std::uint32_t, 64> fetched_;  // by vertex: when
  mutable SharedPages<TetVertexState, 32> vertices_;
  SharedPages<Tetrahedron, 64> tets_;
  SharedPages<std::vector<std::uint32_t>, 16> star_;
  std::vector<Operation> journal_;
  std::size_t vertices_before_ = 0, tets_before_ = 0;  // without the operations
  std::size_t fetchable_ = 0;                          // vertices
  mutable Scratch scratch_;
};

}  // namespace sectio
