// The tetrahedra at each vertex, and what linear shape functions say of one tetrahedron.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "common/mesh/slot_table.h"
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

inline std::size_t corner_of(const Tetrahedron& t, VertexId v) {
  return static_cast<std::size_t>(std::ranges::find(t, v) - t.begin());
}

// Ascending at each vertex, so that sums have one order whatever the history.
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

 private:
  std::vector<std::vector<std::uint32_t>> tets_;
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
