#include "sim_server/surface/cutting/islands.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <unordered_set>
#include <utility>

#include "sim_server/surface/cutting/cap.h"

namespace sectio {
namespace {

constexpr double kLeastArea_m2 = 4e-6;     // an island's skin at rest: a crumb between two cuts stays on its ground
constexpr double kMostOverGroove = 4;      // depths of the groove, from its bottom to the top of an island's skin
constexpr std::size_t kMostOfCrumb = 200;  // triangles

// A breadth-first search over skin.
class SkinSearch {
 public:
  explicit SkinSearch(const MeshDraft& draft) : draft_(draft) {}
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

std::vector<TriangleId> all_skin_from(const MeshDraft& draft, VertexId from) {
  SkinSearch search(draft, from);
  const SkinSearch none(draft);
  while (!search.exhausted()) search.expand(none);
  return search.triangles();
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

using Edge = std::pair<VertexId, VertexId>;

// A vertex of a rim, with the triangles of one side that lie between the rim's edges there. A rim that meets itself has
// several corners at one vertex, and others on the other side.
struct RimCorner {
  VertexId vertex = kNone;
  std::vector<TriangleId> wedge;
};
using BottomRim = std::vector<RimCorner>;

enum class Side : std::uint8_t { region, ground };

// The edges around the region, with it to the left.
std::set<Edge> edges_around(const MeshDraft& draft, const std::vector<TriangleId>& region,
                            const std::unordered_set<TriangleId>& inside) {
  std::set<Edge> edges;
  for (const TriangleId id : region) {
    const Triangle t = draft.triangle(id);
    for (int i = 0; i < 3; ++i)
      if (!inside.contains(draft.neighbour(id, i)))
        edges.emplace(t.v[static_cast<std::size_t>(i)], t.v[static_cast<std::size_t>((i + 1) % 3)]);
  }
  return edges;
}

// The corner at the end of an edge, found by turning around it within one side; the edge becomes the next one.
RimCorner turn_corner(const MeshDraft& draft, const std::unordered_set<TriangleId>& inside, Side side, Edge& edge) {
  const auto [from, at] = edge;
  RimCorner corner{at, {}};
  const bool in_region = side == Side::region;
  TriangleId t = in_region ? draft.triangle_of_edge(from, at) : draft.triangle_of_edge(at, from);
  while (t != kNone && inside.contains(t) == in_region) {
    corner.wedge.push_back(t);
    const Triangle triangle = draft.triangle(t);
    const VertexId to = in_region ? triangle.after(at) : triangle.before(at);
    edge = {at, to};
    t = in_region ? draft.triangle_of_edge(to, at) : draft.triangle_of_edge(at, to);
  }
  return corner;
}

// Empty if a rim has fewer than three corners.
std::vector<BottomRim> rims_of(const MeshDraft& draft, const std::unordered_set<TriangleId>& inside, Side side,
                               std::set<Edge> edges) {
  std::vector<BottomRim> rims;
  while (!edges.empty()) {
    BottomRim& rim = rims.emplace_back();
    const Edge first = *edges.begin();
    Edge edge = first;
    do {
      if (edges.erase(edge) == 0) return {};
      rim.push_back(turn_corner(draft, inside, side, edge));
    } while (edge != first);
    std::rotate(rim.begin(), rim.end() - 1, rim.end());
    if (rim.size() < 3) return {};
  }
  return rims;
}

// The ground that is connected with a corner of its rim; nothing if that is more than a crumb.
std::optional<std::vector<TriangleId>> crumb_at(const MeshDraft& draft, const RimCorner& corner,
                                                const std::unordered_set<TriangleId>& inside) {
  std::vector<TriangleId> crumb = corner.wedge;
  std::unordered_set<TriangleId> seen(crumb.begin(), crumb.end());
  for (std::size_t k = 0; k < crumb.size(); ++k)
    for (int i = 0; i < 3; ++i) {
      const TriangleId n = draft.neighbour(crumb[k], i);
      if (inside.contains(n) || !seen.insert(n).second) continue;
      crumb.push_back(n);
      if (crumb.size() > kMostOfCrumb) return std::nullopt;
    }
  std::vector<TriangleId> skin;
  std::ranges::copy_if(crumb, std::back_inserter(skin),
                       [&](TriangleId t) { return draft.triangle(t).surface == Surface::skin; });
  if (area_m2(draft, skin) >= kLeastArea_m2) return std::nullopt;
  return crumb;
}

// The rims at which an island and its ground part.
struct PartingRims {
  std::vector<BottomRim> of_region, of_ground;
};

// `inside`: the region with its walls. Crumbs of ground go with the region.
std::optional<PartingRims> rims_around(const MeshDraft& draft, std::vector<TriangleId> region,
                                       std::unordered_set<TriangleId> inside) {
  std::set<Edge> edges;
  PartingRims rims;
  for (bool has_grown = true; std::exchange(has_grown, false);) {
    edges = edges_around(draft, region, inside);
    rims.of_ground = rims_of(draft, inside, Side::ground, edges);
    for (std::size_t k = 0; k < rims.of_ground.size() && !has_grown; ++k)
      if (const auto crumb = crumb_at(draft, rims.of_ground[k].front(), inside)) {
        region.insert(region.end(), crumb->begin(), crumb->end());
        inside.insert(crumb->begin(), crumb->end());
        has_grown = true;
      }
  }
  rims.of_region = rims_of(draft, inside, Side::region, std::move(edges));
  if (rims.of_region.empty() || rims.of_ground.empty()) return std::nullopt;
  return rims;
}

// A bottom at which two sides part, seen from one of them; at rest.
struct Neck {
  Vec3 middle_m = Vec3::Zero(), normal = Vec3::Zero();  // unit, towards that side
  double radius_m = 0, depth_m = 0;                     // twice the area over the perimeter; mean, of the groove

  bool is_wide() const { return radius_m > depth_m; }
};

Neck neck_at(const MeshDraft& draft, const Grooves& grooves, const BottomRim& rim) {
  Neck neck;
  double perimeter_m = 0, rungs = 0;
  const auto at = [&](std::size_t i) { return draft.rest(rim[i % rim.size()].vertex); };
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const double length_m = (at(i + 1) - at(i)).norm();
    neck.middle_m += 0.5 * length_m * (at(i) + at(i + 1));
    perimeter_m += length_m;
  }
  neck.middle_m /= perimeter_m;
  Vec3 area_m2 = Vec3::Zero();
  for (std::size_t i = 0; i < rim.size(); ++i)
    area_m2 += 0.5 * (at(i) - neck.middle_m).cross(at(i + 1) - neck.middle_m);
  neck.normal = area_m2.stableNormalized();
  neck.radius_m = 2 * area_m2.norm() / perimeter_m;
  for (const Rung& rung : grooves.rungs)
    if (std::ranges::find(rim, rung.bottom, &RimCorner::vertex) != rim.end()) {
      neck.depth_m += (draft.rest(rung.lip) - draft.rest(rung.bottom)).norm();
      ++rungs;
    }
  neck.depth_m /= std::max(rungs, 1.0);
  return neck;
}

// A side that is parted from the rest along wide necks is thin: it has one of them, and no skin that stands higher over
// that than the groove explains. Between two of them lies the whole thickness of a limb.
bool is_thin(const MeshDraft& draft, const Grooves& grooves, const std::vector<BottomRim>& rims,
             const std::vector<TriangleId>& skin) {
  std::size_t wide = 0;
  for (const BottomRim& rim : rims) {
    const Neck neck = neck_at(draft, grooves, rim);
    if (!neck.is_wide()) continue;
    if (++wide > 1) return false;
    for (const TriangleId t : skin)
      for (const VertexId v : draft.triangle(t).v)
        if ((draft.rest(v) - neck.middle_m).dot(neck.normal) > kMostOverGroove * neck.depth_m) return false;
  }
  return true;
}

// The same for the side that the search has not exhausted.
bool is_thin_beyond(const MeshDraft& draft, const Grooves& grooves, VertexId from) {
  std::vector<TriangleId> region = all_skin_from(draft, from);
  const std::vector<TriangleId> skin = region;
  std::unordered_set<TriangleId> inside = with_walls(draft, grooves, region);
  const auto rims = rims_around(draft, std::move(region), std::move(inside));
  return rims && is_thin(draft, grooves, rims->of_region, skin);
}

// Gives the two sides vertices of their own along their rims, and closes each with a cap.
class Parting {
 public:
  explicit Parting(MeshDraft& draft) : draft_(draft) {}

  void free(const BottomRim& rim, Island& island) {
    const std::vector<VertexState> states = states_of(rim);
    const Cap cap = cap_of(states);
    std::vector<VertexId> vertices;
    for (const RimCorner& corner : rim) vertices.push_back(own_vertex(corner));
    island.any_vertex = close(std::move(vertices), cap, Side::region);
    island.bed_point_world_m = cap.inner.back().position_world_m;
    Vec3 area = Vec3::Zero();
    for (std::size_t i = 0; i < states.size(); ++i)
      area += (states[i].position_world_m - island.bed_point_world_m)
                  .cross(states[(i + 1) % states.size()].position_world_m - island.bed_point_world_m);
    island.bed_normal_world = area.stableNormalized();
  }
  void cover_ground(const BottomRim& rim) {
    std::vector<VertexId> vertices;
    for (const RimCorner& corner : rim)
      vertices.push_back(met_.insert(corner.vertex).second ? corner.vertex : own_vertex(corner));
    close(std::move(vertices), cap_of(states_of(rim)), Side::ground);
  }
  // False when the draft can't take the change.
  bool apply() {
    std::vector<TriangleId> removed;
    for (const auto& [t, after] : changed_) {
      removed.push_back(t);
      added_.push_back(after);
    }
    return draft_.replace(removed, added_);
  }

 private:
  VertexId own_vertex(const RimCorner& corner) {
    const VertexId own = draft_.add_vertex(draft_.state(corner.vertex));
    for (const TriangleId t : corner.wedge)
      for (VertexId& v : changed_.try_emplace(t, draft_.triangle(t)).first->second.v)
        if (v == corner.vertex) v = own;
    return own;
  }
  std::vector<VertexState> states_of(const BottomRim& rim) const {
    std::vector<VertexState> states;
    for (const RimCorner& corner : rim) states.push_back(draft_.state(corner.vertex));
    return states;
  }
  // Closes a rim whose corners have these vertices; returns the middle of the cap.
  VertexId close(std::vector<VertexId> vertices, const Cap& cap, Side side) {
    for (const VertexState& s : cap.inner) vertices.push_back(draft_.add_vertex(s));
    for (const auto& [a, b, c] : cap.triangles)
      added_.push_back({side == Side::ground ? std::array{vertices[a], vertices[b], vertices[c]}
                                             : std::array{vertices[b], vertices[a], vertices[c]},
                        Surface::wall});
    return vertices.back();
  }

  MeshDraft& draft_;
  std::map<TriangleId, Triangle> changed_;
  std::vector<Triangle> added_;
  std::set<VertexId> met_;  // along rims of the ground
};

}  // namespace

LoopOutcome free_island(MeshDraft& draft, const Grooves& grooves, VertexId left, VertexId right) {
  std::vector<TriangleId> region = parted_skin(draft, left, right);
  if (region.empty() || area_m2(draft, region) < kLeastArea_m2) return {};
  const std::vector<TriangleId> skin = region;
  std::unordered_set<TriangleId> inside = with_walls(draft, grooves, region);
  const auto rims = rims_around(draft, std::move(region), std::move(inside));
  if (!rims) return {{}, "the bottom of its loop is not whole"};
  if (!is_thin(draft, grooves, rims->of_region, skin)) {
    const bool is_left = std::ranges::find(skin, draft.fan(left).front()) != skin.end();
    if (!is_thin_beyond(draft, grooves, is_left ? right : left))
      return {{}, "its loop is too shallow for what it surrounds"};
  }
  Island island;
  Parting parting(draft);
  for (const BottomRim& rim : rims->of_region) parting.free(rim, island);
  for (const BottomRim& rim : rims->of_ground) parting.cover_ground(rim);
  if (!parting.apply()) return {{}, "the surface would not stay whole"};
  return {island, {}};
}

}  // namespace sectio
