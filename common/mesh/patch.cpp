#include "common/mesh/patch.h"

#include <algorithm>

namespace sectio {
namespace {

struct HalfEdge {
  VertexId from, to;
  TriangleId triangle;
  bool operator<(const HalfEdge& o) const { return from != o.from ? from < o.from : to < o.to; }
  bool same_edge(const HalfEdge& o) const { return from == o.from && to == o.to; }
};

bool has_duplicates(const std::vector<HalfEdge>& sorted) {
  return std::adjacent_find(sorted.begin(), sorted.end(),
                            [](const HalfEdge& a, const HalfEdge& b) { return a.same_edge(b); }) != sorted.end();
}

const HalfEdge* find(const std::vector<HalfEdge>& sorted, VertexId from, VertexId to) {
  const auto it = std::lower_bound(sorted.begin(), sorted.end(), HalfEdge{from, to, kNone});
  return it != sorted.end() && it->from == from && it->to == to ? &*it : nullptr;
}

}  // namespace

bool link_patch(std::span<const PatchTriangle> patch, std::vector<Link>& links) {
  links.clear();
  const auto in_patch = [&](TriangleId t) {
    return std::binary_search(patch.begin(), patch.end(), PatchTriangle{t, {}, {}, {}},
                              [](const PatchTriangle& a, const PatchTriangle& b) { return a.id < b.id; });
  };
  std::vector<HalfEdge> rim;    // edges of the hole, which the patch must have again, with the triangle outside
  std::vector<HalfEdge> edges;  // the triangles' edges afterwards
  for (const PatchTriangle& p : patch) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (p.before.alive() && !in_patch(p.neighbours_before[i]))
        rim.push_back({p.before.v[i], p.before.v[(i + 1) % 3], p.neighbours_before[i]});
      if (p.after.alive()) edges.push_back({p.after.v[i], p.after.v[(i + 1) % 3], p.id});
    }
  }
  std::sort(rim.begin(), rim.end());
  std::sort(edges.begin(), edges.end());
  if (has_duplicates(rim) || has_duplicates(edges)) return false;

  std::size_t rim_used = 0;
  for (const HalfEdge& e : edges) {
    const HalfEdge* opposite = find(edges, e.to, e.from);
    const HalfEdge* outside = find(rim, e.from, e.to);
    if ((opposite != nullptr) == (outside != nullptr)) return false;  // an edge has exactly one other side
    if (opposite) {
      links.push_back({e.triangle, e.from, opposite->triangle});
    } else {
      links.push_back({e.triangle, e.from, outside->triangle});
      links.push_back({outside->triangle, e.to, e.triangle});
      ++rim_used;
    }
  }
  return rim_used == rim.size();
}

}  // namespace sectio
