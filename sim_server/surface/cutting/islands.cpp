#include "sim_server/surface/cutting/islands.h"

#include <algorithm>
#include <map>
#include <unordered_set>

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

VertexState centre_of(const MeshDraft& draft, const std::vector<VertexId>& loop) {
  VertexState c;
  for (const VertexId v : loop) {
    const VertexState s = draft.state(v);
    c.rest_body_m += s.rest_body_m;
    c.position_world_m += s.position_world_m;
    c.velocity_world_m_per_s += s.velocity_world_m_per_s;
  }
  const double n = static_cast<double>(loop.size());
  return {c.rest_body_m / n, c.position_world_m / n, c.velocity_world_m_per_s / n};
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
    const VertexState centre = centre_of(draft, loop);
    const VertexId c_out = draft.add_vertex(centre), c_in = draft.add_vertex(centre);
    Vec3 area = Vec3::Zero();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const VertexId a = loop[i], b = loop[(i + 1) % loop.size()];
      added.push_back({{a, b, c_out}, Surface::wall});
      added.push_back({{twin[b], twin[a], c_in}, Surface::wall});
      area += (draft.position(a) - centre.position_world_m).cross(draft.position(b) - centre.position_world_m);
    }
    island.bed_point_world_m = centre.position_world_m;
    island.bed_normal_world = area.stableNormalized();
    island.any_vertex = c_in;
  }
  if (!draft.replace(removed, added)) return std::nullopt;
  return island;
}

}  // namespace sectio
