#include "sim_server/volume/tets/collapse.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kSharp = 0.5;       // largest cosine between the normals at a crease
constexpr double kKeptHeight = 0.5;  // least height after a collapse, over the least before

using Pair = std::array<VertexId, 2>;
using Corners3 = std::array<VertexId, 3>;

double mean_edge_m(const TetTopology& volume, VertexId v, VertexId w) {
  double sum_m = 0;
  std::size_t edges = 0;
  for (const std::uint32_t t : volume.star(v)) {
    const Tetrahedron& c = volume.tetrahedra()[t];
    if (!has(c, w)) continue;
    for (const auto& [i, j] : kTetEdges)
      sum_m += (volume.vertex(c[i]).rest_body_m - volume.vertex(c[j]).rest_body_m).norm();
    edges += kTetEdges.size();
  }
  return sum_m / static_cast<double>(edges);
}

// The triangles of the surface at v are (v, rim[i], rim[i + 1]), cyclically.
struct Fan {
  std::vector<VertexId> rim;  // empty: v is inside
  bool is_one = true;         // false: the surface touches itself in v

  VertexId at(std::size_t i) const { return rim[i % rim.size()]; }
  bool has(VertexId w) const { return std::ranges::find(rim, w) != rim.end(); }
};

Fan fan_at(const TetTopology& volume, VertexId v) {
  std::map<VertexId, VertexId> next;
  Fan fan;
  for (const std::uint32_t t : volume.star(v)) {
    const Tetrahedron& c = volume.tetrahedra()[t];
    for (std::size_t corner = 0; corner < 4; ++corner) {
      if (c[corner] == v || volume.across(t, corner) != kNone) continue;
      const auto& side = kTetFaces[corner];
      std::size_t k = 0;
      while (c[side[k]] != v) ++k;
      fan.is_one &= next.emplace(c[side[(k + 1) % 3]], c[side[(k + 2) % 3]]).second;
    }
  }
  if (next.empty()) return fan;
  VertexId p = next.begin()->first;
  do {
    fan.rim.push_back(p);
    const auto it = next.find(p);
    if (it == next.end()) return {std::move(fan.rim), false};
    p = it->second;
  } while (p != fan.rim.front() && fan.rim.size() < next.size());
  fan.is_one &= p == fan.rim.front() && fan.rim.size() == next.size();
  return fan;
}

// The link of a vertex: the simplices opposite it in its tetrahedra, each ascending.
struct LinkOf {
  std::vector<VertexId> vertices;
  std::vector<Pair> edges;
  std::vector<Corners3> triangles;

  LinkOf(const TetTopology& volume, VertexId v) {
    for (const std::uint32_t t : volume.star(v)) {
      Corners3 c;
      std::ranges::copy_if(volume.tetrahedra()[t], c.begin(), [v](VertexId u) { return u != v; });
      std::ranges::sort(c);
      triangles.push_back(c);
      edges.insert(edges.end(), {{c[0], c[1]}, {c[0], c[2]}, {c[1], c[2]}});
      vertices.insert(vertices.end(), c.begin(), c.end());
    }
    sort_unique(vertices), sort_unique(edges), sort_unique(triangles);
  }
  // The link in the surface.
  explicit LinkOf(const Fan& fan) : vertices(fan.rim) {
    for (std::size_t i = 0; i < fan.rim.size(); ++i)
      edges.push_back({std::min(fan.at(i), fan.at(i + 1)), std::max(fan.at(i), fan.at(i + 1))});
    sort_unique(vertices), sort_unique(edges);
  }
};

template <class T>
std::vector<T> common(const std::vector<T>& a, const std::vector<T>& b) {
  std::vector<T> both;
  std::ranges::set_intersection(a, b, std::back_inserter(both));
  return both;
}

// The link condition: the intersection of the links of v and w is the link of their edge, inside and on the surface.
bool stays_manifold(const TetTopology& volume, VertexId v, VertexId w, const Fan& fan_v, const Fan& fan_w) {
  const LinkOf at_v(volume, v), at_w(volume, w);
  std::size_t around = 0;
  std::vector<VertexId> ends;
  for (const std::uint32_t t : volume.star(v)) {
    const Tetrahedron& c = volume.tetrahedra()[t];
    if (!has(c, w)) continue;
    ++around;
    std::ranges::copy_if(c, std::back_inserter(ends), [&](VertexId u) { return u != v && u != w; });
  }
  sort_unique(ends);
  if (common(at_v.vertices, at_w.vertices).size() != ends.size()) return false;
  if (common(at_v.edges, at_w.edges).size() != around) return false;
  if (!common(at_v.triangles, at_w.triangles).empty()) return false;
  if (fan_v.rim.empty()) return true;
  const LinkOf outside_v(fan_v), outside_w(fan_w);
  return fan_v.is_one && fan_w.is_one && fan_v.has(w) && common(outside_v.vertices, outside_w.vertices).size() == 2 &&
         common(outside_v.edges, outside_w.edges).empty();
}

// Whether v is near the straight line from w to u, and between them.
bool is_straight(const Vec3& v, const Vec3& w, const Vec3& u, double within_m) {
  const Vec3 along = u - w;
  return (v - w).dot(along) >= 0 && (u - v).dot(along) >= 0 && (v - w).cross(along).norm() <= within_m * along.norm();
}

CollapseVerdict judge_surface(const TetTopology& volume, VertexId v, VertexId w, const Fan& fan,
                              const SurfaceLabel& kind) {
  const auto at = [&](VertexId u) -> const Vec3& { return volume.vertex(u).rest_body_m; };
  const std::size_t n = fan.rim.size();
  const double mean_m = mean_edge_m(volume, v, w), within_m = kCollapseOff * mean_m;
  std::vector<Vec3> normal(n);  // twice the area
  std::vector<int> kinds(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    normal[i] = (at(fan.at(i)) - at(v)).cross(at(fan.at(i + 1)) - at(v));
    if (kind) kinds[i] = kind({v, fan.at(i), fan.at(i + 1)});
  }
  std::vector<VertexId> creases;
  for (std::size_t i = 0, before = n - 1; i < n; before = i++)
    if (kinds[before] != kinds[i] || normal[before].dot(normal[i]) < kSharp * normal[before].norm() * normal[i].norm())
      creases.push_back(fan.at(i));
  if (creases.size() == 1 || creases.size() > 2) return CollapseVerdict::corner;
  if (creases.size() == 2) {
    if (!is_straight(at(v), at(creases[0]), at(creases[1]), within_m)) return CollapseVerdict::corner;
    if (w != creases[0] && w != creases[1]) return CollapseVerdict::sideways;
  }
  double swept_m3 = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (fan.at(i) == w || fan.at(i + 1) == w) continue;
    const Vec3 after = (at(fan.at(i)) - at(w)).cross(at(fan.at(i + 1)) - at(w));
    const double six_m3 = normal[i].dot(at(w) - at(v));
    if (normal[i].dot(after) <= 0 || std::abs(six_m3) > within_m * std::max(normal[i].norm(), after.norm()))
      return CollapseVerdict::bent;
    swept_m3 += six_m3 / 6;
  }
  return std::abs(swept_m3) > kCollapseVolume * std::pow(mean_m, 3) ? CollapseVerdict::bent : CollapseVerdict::fine;
}

double world_volume_m3(const TetTopology& volume, const Tetrahedron& c) {
  const auto at = [&](std::size_t k) -> const Vec3& { return volume.vertex(c[k]).position_world_m; };
  return tet_volume_m3(at(0), at(1), at(2), at(3));
}

double quality(const TetTopology& volume, const Tetrahedron& c) {
  const auto at = [&](std::size_t k) -> const Vec3& { return volume.vertex(c[k]).rest_body_m; };
  return shape_quality(at(0), at(1), at(2), at(3));
}

// The least height, to which the stable step is proportional.
double height_m(const TetTopology& volume, const Tetrahedron& c) {
  const auto at = [&](std::size_t k) -> const Vec3& { return volume.vertex(c[k]).rest_body_m; };
  double twice_m2 = 0;
  for (const auto& [i, j, k] : kTetFaces) twice_m2 = std::max(twice_m2, (at(j) - at(i)).cross(at(k) - at(i)).norm());
  return 6 * tet_volume_m3(at(0), at(1), at(2), at(3)) / twice_m2;
}

bool gets_no_worse(const TetTopology& volume, VertexId v, VertexId w) {
  double worst = 1, least_m = HUGE_VAL;
  for (const std::uint32_t t : volume.star(v)) {
    worst = std::min(worst, quality(volume, volume.tetrahedra()[t]));
    least_m = std::min(least_m, height_m(volume, volume.tetrahedra()[t]));
  }
  return std::ranges::all_of(volume.star(v), [&](std::uint32_t t) {
    Tetrahedron moved = volume.tetrahedra()[t];
    if (has(moved, w)) return true;
    *std::ranges::find(moved, v) = w;
    return quality(volume, moved) >= std::max(worst, 1e-9) && height_m(volume, moved) >= kKeptHeight * least_m &&
           world_volume_m3(volume, moved) > 0;
  });
}

}  // namespace

const char* to_string(CollapseVerdict verdict) {
  switch (verdict) {
    case CollapseVerdict::fine:
      return "fine";
    case CollapseVerdict::torn:
      return "torn";
    case CollapseVerdict::inward:
      return "inward";
    case CollapseVerdict::corner:
      return "corner";
    case CollapseVerdict::sideways:
      return "sideways";
    case CollapseVerdict::bent:
      return "bent";
    case CollapseVerdict::flat:
      return "flat";
  }
  return "?";
}

double shape_quality(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double squares = (a - b).squaredNorm() + (a - c).squaredNorm() + (a - d).squaredNorm() + (b - c).squaredNorm() +
                         (b - d).squaredNorm() + (c - d).squaredNorm();
  return 6 * std::sqrt(2.0) * tet_volume_m3(a, b, c, d) / std::pow(squares / 6, 1.5);
}

double shape_quality(const TetTopology& volume, std::uint32_t t) {
  return quality(volume, volume.tetrahedra()[t]);
}

double edge_ratio(const TetTopology& volume, VertexId v, VertexId w) {
  return (volume.vertex(v).rest_body_m - volume.vertex(w).rest_body_m).norm() / mean_edge_m(volume, v, w);
}

CollapseVerdict judge_collapse(const TetTopology& volume, VertexId v, VertexId w, const SurfaceLabel& kind) {
  const Fan at_v = fan_at(volume, v), at_w = fan_at(volume, w);
  if (!at_v.rim.empty() && at_w.rim.empty()) return CollapseVerdict::inward;
  if (!stays_manifold(volume, v, w, at_v, at_w)) return CollapseVerdict::torn;
  if (!at_v.rim.empty())
    if (const CollapseVerdict shape = judge_surface(volume, v, w, at_v, kind); shape != CollapseVerdict::fine)
      return shape;
  return gets_no_worse(volume, v, w) ? CollapseVerdict::fine : CollapseVerdict::flat;
}

std::optional<VertexId> collapse_onto(const TetTopology& volume, VertexId v, double ratio, const SurfaceLabel& kind) {
  std::vector<std::pair<double, VertexId>> ends;
  for (const std::uint32_t t : volume.star(v))
    for (const VertexId w : volume.tetrahedra()[t])
      if (w != v) ends.emplace_back((volume.vertex(v).rest_body_m - volume.vertex(w).rest_body_m).squaredNorm(), w);
  sort_unique(ends);
  for (const auto& [length2, w] : ends)
    if (edge_ratio(volume, v, w) < ratio && judge_collapse(volume, v, w, kind) == CollapseVerdict::fine) return w;
  return {};
}

}  // namespace sectio
