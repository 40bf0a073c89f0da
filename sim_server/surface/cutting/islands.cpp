#include "sim_server/surface/cutting/islands.h"

#include <algorithm>
#include <map>
#include <unordered_set>

#include "sim_server/surface/cutting/cap.h"

namespace sectio {
namespace {

constexpr double kLeastAreaM2 = 4e-6;  // an island's skin at rest: a crumb between two cuts stays on its ground

// A breadth-first search over skin.
class SkinSearch {
 public:
  SkinSearch(const MeshDraft& draft, VertexId from) : draft_(draft) {
    for (const TriangleId t : draft.fan(from))
      if (draft.triangle(t).surface == Surface::skin && seen_.insert(t).second) order_.push_back(t);
  }
  bool exhausted() const { return next_ == order_.size(); }
  bool empty() const { return order_.empty(); }
  bool contains(TriangleId t) const { return seen_.contains(t); }
  const std::vector<TriangleId>& triangles() const { return order_; }

  // Expands one more triangle; true when the other search has seen a neighbour of it, too.
  bool expand(const SkinSearch& other) {
    const TriangleId t = order_[next_++];
    if (other.contains(t)) return true;
    for (int i = 0; i < 3; ++i) {
      const TriangleId n = draft_.neighbour(t, i);
      if (draft_.triangle(n).surface == Surface::skin && seen_.insert(n).second) order_.push_back(n);
    }
    return false;
  }

 private:
  const MeshDraft& draft_;
  std::unordered_set<TriangleId> seen_;  // asked, never iterated
  std::vector<TriangleId> order_;
  std::size_t next_ = 0;
};

// The skin that one of two searches has exhausted without meeting the other; empty when they meet.
std::vector<TriangleId> parted_skin(const MeshDraft& draft, VertexId left, VertexId right) {
  SkinSearch a(draft, left), b(draft, right);
  if (a.empty() || b.empty()) return {};
  while (!a.exhausted() && !b.exhausted())
    if (a.expand(b) || b.expand(a)) return {};
  const SkinSearch& done = a.exhausted() ? a : b;
  const SkinSearch& other = a.exhausted() ? b : a;
  for (const TriangleId t : done.triangles())
    if (other.contains(t)) return {};
  return done.triangles();
}

double area_m2(const MeshDraft& draft, const std::vector<TriangleId>& region) {
  double sum = 0;
  for (const TriangleId id : region) {
    const auto& v = draft.triangle(id).v;
    const Vec3 a = draft.rest(v[0]);
    sum += 0.5 * (draft.rest(v[1]) - a).cross(draft.rest(v[2]) - a).norm();
  }
  return sum;
}

// The skin with the walls on its side of the bottom: edges between two bottom vertices are not crossed.
std::unordered_set<TriangleId> with_walls(const MeshDraft& draft, const Grooves& grooves,
                                          std::vector<TriangleId>& region) {
  std::unordered_set<TriangleId> inside(region.begin(), region.end());
  for (std::size_t k = 0; k < region.size(); ++k) {
    const Triangle t = draft.triangle(region[k]);
    for (int i = 0; i < 3; ++i) {
      const VertexId u = t.v[static_cast<std::size_t>(i)], w = t.v[static_cast<std::size_t>((i + 1) % 3)];
      const TriangleId n = draft.neighbour(region[k], i);
      if (draft.triangle(n).surface != Surface::wall || (grooves.bottoms.contains(u) && grooves.bottoms.contains(w)))
        continue;
      if (inside.insert(n).second) region.push_back(n);
    }
  }
  return inside;
}

// The rim of the region as loops of vertices, with the region to the left. Empty if a vertex is on the rim twice.
std::vector<std::vector<VertexId>> rim_of(const MeshDraft& draft, const std::vector<TriangleId>& region,
                                          const std::unordered_set<TriangleId>& inside) {
  std::map<VertexId, VertexId> next;
  for (const TriangleId id : region) {
    const Triangle t = draft.triangle(id);
    for (int i = 0; i < 3; ++i)
      if (!inside.contains(draft.neighbour(id, i)) &&
          !next.emplace(t.v[static_cast<std::size_t>(i)], t.v[static_cast<std::size_t>((i + 1) % 3)]).second)
        return {};
  }
  std::vector<std::vector<VertexId>> loops;
  while (!next.empty()) {
    std::vector<VertexId>& loop = loops.emplace_back();
    for (auto it = next.begin(); it != next.end();) {
      loop.push_back(it->first);
      const VertexId to = it->second;
      next.erase(it);
      it = next.find(to);
    }
    if (loop.size() < 3) return {};
  }
  return loops;
}

}  // namespace

std::optional<Island> free_island(MeshDraft& draft, const Grooves& grooves, VertexId left, VertexId right) {
  std::vector<TriangleId> region = parted_skin(draft, left, right);
  if (region.empty() || area_m2(draft, region) < kLeastAreaM2) return std::nullopt;
  const std::unordered_set<TriangleId> inside = with_walls(draft, grooves, region);
  const auto loops = rim_of(draft, region, inside);
  if (loops.empty()) return std::nullopt;

  Island island;
  std::map<VertexId, VertexId> twin;
  for (const auto& loop : loops)
    for (const VertexId v : loop) twin[v] = draft.add_vertex(draft.state(v));

  std::vector<TriangleId> removed;
  std::vector<Triangle> added;
  for (const TriangleId id : region) {
    Triangle t = draft.triangle(id);
    bool on_rim = false;
    for (VertexId& v : t.v)
      if (const auto it = twin.find(v); it != twin.end()) {
        v = it->second;
        on_rim = true;
      }
    if (!on_rim) continue;
    removed.push_back(id);
    added.push_back(t);
  }
  for (const auto& loop : loops) {
    std::vector<VertexState> rim;
    std::vector<VertexId> out(loop), in;  // the cap's vertices, on the ground and on the island
    for (const VertexId v : loop) {
      rim.push_back(draft.state(v));
      in.push_back(twin[v]);
    }
    const Cap cap = cap_of(rim);
    for (const VertexState& s : cap.inner) {
      out.push_back(draft.add_vertex(s));
      in.push_back(draft.add_vertex(s));
    }
    for (const auto& [a, b, c] : cap.triangles) {
      added.push_back({{out[a], out[b], out[c]}, Surface::wall});
      added.push_back({{in[b], in[a], in[c]}, Surface::wall});
    }
    const Vec3& centre = cap.inner.back().position_world_m;
    Vec3 area = Vec3::Zero();
    for (std::size_t i = 0; i < rim.size(); ++i)
      area += (rim[i].position_world_m - centre).cross(rim[(i + 1) % rim.size()].position_world_m - centre);
    island.bed_point_world_m = centre;
    island.bed_normal_world = area.stableNormalized();
    island.any_vertex = in.back();
  }
  if (!draft.replace(removed, added)) return std::nullopt;
  return island;
}

}  // namespace sectio
