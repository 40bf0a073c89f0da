// The tetrahedra at each vertex, and what linear shape functions say of one tetrahedron.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

struct TetShape {
  std::array<Vec3, 4> gradient;  // of the shape functions, at rest, 1/m
  double volume_m3 = 0;
};

inline TetShape tet_shape(const TetMesh& mesh, const Tetrahedron& t) {
  TetShape shape;
  shape.volume_m3 = tet_volume_m3(mesh, t);
  const auto& x = mesh.vertices_body_m;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [p, q, r] = kTetFaces[i];
    shape.gradient[i] = (x[t[r]] - x[t[p]]).cross(x[t[q]] - x[t[p]]) / (6 * shape.volume_m3);
  }
  return shape;
}

// Ascending at each vertex.
class TetStars {
 public:
  explicit TetStars(const TetMesh& mesh) : first_(mesh.vertices_body_m.size() + 1, 0) {
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (const VertexId v : t) ++first_[v + 1];
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    tets_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
      for (const VertexId v : mesh.tetrahedra[t]) tets_[next[v]++] = t;
  }
  std::span<const std::uint32_t> of(VertexId v) const { return {tets_.data() + first_[v], first_[v + 1] - first_[v]}; }

 private:
  std::vector<std::uint32_t> first_, tets_;
};

// Sums by neighbour of one vertex at a time.
class NeighbourRow {
 public:
  NeighbourRow(const TetMesh& mesh, const TetStars& stars) : mesh_(mesh), stars_(stars) {}

  struct Entry {
    VertexId to;
    double sum;
  };
  // The neighbours of v in ascending order, with sums of 0.
  void begin(VertexId v) {
    entries_.clear();
    for (const std::uint32_t t : stars_.of(v))
      for (const VertexId w : mesh_.tetrahedra[t])
        if (w != v) entries_.push_back({w, 0});
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.to < b.to; });
    entries_.erase(
        std::unique(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.to == b.to; }),
        entries_.end());
  }
  void add(VertexId to, double value) {
    std::lower_bound(entries_.begin(), entries_.end(), to, [](const Entry& e, VertexId v) { return e.to < v; })->sum +=
        value;
  }
  std::span<const Entry> entries() const { return entries_; }

 private:
  const TetMesh& mesh_;
  const TetStars& stars_;
  std::vector<Entry> entries_;
};

}  // namespace sectio
