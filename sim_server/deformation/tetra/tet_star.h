// The star of a vertex in a mesh of tetrahedra: the tetrahedra at the vertex, and their corners.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "common/mesh/slot_table.h"
#include "common/mesh/tet_mesh.h"

namespace sectio {

inline std::size_t corner_of(const Tetrahedron& t, VertexId v) {
  return static_cast<std::size_t>(std::ranges::find(t, v) - t.begin());
}

// The tetrahedra at each vertex, ascending, so that sums have one order whatever the history.
class TetStars {
 public:
  explicit TetStars(const TetMesh& mesh) : tets_(mesh.vertices_body_m.size()) {
    std::vector<std::uint32_t> size(tets_.size(), 0);
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (const VertexId v : t) ++size[v];
    for (std::size_t v = 0; v < tets_.size(); ++v) tets_[v].reserve(size[v]);
    for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
      for (const VertexId v : mesh.tetrahedra[t]) tets_[v].push_back(t);
    give_room(tets_);
  }
  std::span<const std::uint32_t> of(VertexId v) const { return tets_[v]; }

  void follow(std::size_t vertices, std::span<const TetEdit> edits) {
    resize_slots(tets_, vertices, {});
    for (const TetEdit& e : edits) {
      if (e.before == e.after) continue;
      for (const VertexId v : e.before)
        if (v != kNone && corner_of(e.after, v) == 4) std::erase(tets_[v], e.id);
      for (const VertexId v : e.after)
        if (v != kNone && corner_of(e.before, v) == 4) tets_[v].insert(std::ranges::lower_bound(tets_[v], e.id), e.id);
    }
  }

  template <class A>
  void archive(A& a) {
    a(tets_);
  }

 private:
  std::vector<std::vector<std::uint32_t>> tets_;
};

// The star of one vertex at a time: its tetrahedra, their corners and shapes.
class VertexStar {
 public:
  struct Corner {
    std::uint32_t tetrahedron = kNone;
    std::size_t corner = 0;             // the corner of the tetrahedron that is the vertex
    std::array<std::uint32_t, 4> at{};  // indices of the corners in vertices()
    TetShape shape;                     // set by measure()
  };
  // O(degree); longer when the mesh has more vertices than in the last call.
  void begin(const TetMesh& mesh, const TetStars& stars, VertexId v);
  void measure(const TetMesh& mesh);

  std::span<const Corner> corners() const { return {corners_.data(), count_}; }
  // The vertex and its neighbours, in the order in which its tetrahedra name them first.
  std::span<const VertexId> vertices() const { return vertices_; }
  // The neighbours in ascending order, as indices into vertices().
  std::span<const std::uint32_t> ascending() const { return ascending_; }

 private:
  std::vector<Corner> corners_;
  std::size_t count_ = 0;
  std::vector<VertexId> vertices_;
  std::vector<std::uint32_t> ascending_;
  std::vector<std::uint32_t> at_;  // by vertex; kNone between two calls
};

inline void VertexStar::begin(const TetMesh& mesh, const TetStars& stars, VertexId v) {
  resize_slots(at_, mesh.vertices_body_m.size(), kNone);
  vertices_.clear();
  ascending_.clear();
  count_ = stars.of(v).size();
  if (corners_.size() < count_) corners_.resize(count_);
  for (std::size_t n = 0; n < count_; ++n) {
    Corner& c = corners_[n];
    c.tetrahedron = stars.of(v)[n];
    for (std::size_t k = 0; k < 4; ++k) {
      const VertexId w = mesh.tetrahedra[c.tetrahedron][k];
      if (w == v) c.corner = k;
      if (at_[w] == kNone) {
        at_[w] = static_cast<std::uint32_t>(vertices_.size());
        if (w != v) ascending_.push_back(at_[w]);
        vertices_.push_back(w);
      }
      c.at[k] = at_[w];
    }
  }
  for (const VertexId w : vertices_) at_[w] = kNone;
  std::ranges::sort(ascending_, {}, [&](std::uint32_t n) { return vertices_[n]; });
}

inline void VertexStar::measure(const TetMesh& mesh) {
  for (std::size_t n = 0; n < count_; ++n)
    corners_[n].shape = tet_shape(mesh, mesh.tetrahedra[corners_[n].tetrahedron]);
}

}  // namespace sectio
