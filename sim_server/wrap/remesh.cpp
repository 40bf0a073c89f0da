#include "sim_server/wrap/remesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/sort_unique.h"
#include "sim_server/wrap/surface_field.h"

namespace sectio {
namespace {

constexpr double kLong = 4.0 / 3, kShort = 4.0 / 5;  // edges, in the length that is wanted
constexpr double kSameSide = 0.3;                    // cosine between a triangle before and after a change
constexpr double kPoor_rad = 20 * M_PI / 180;        // an angle that is worth another change

class Remesher {
 public:
  Remesher(const TriangleSoup& surface, double edge_m)
      : at_(surface.vertices_body_m), triangles_(surface.triangles), around_(at_.size()), edge_m_(edge_m) {
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (const VertexId v : triangles_[t]) around_[v].push_back(t);
  }

  void run(const SurfaceField& surface, int rounds) {
    for (int round = 0; round < rounds; ++round) {
      split_long();
      collapse_short(kShort * edge_m_);
      flip();
      relax(surface);
    }
    for (int round = 0; round < rounds; ++round) {
      mend_poor();
      flip();
      relax(surface);
    }
    mend_poor();
  }

  TriangleSoup soup() const {
    TriangleSoup out;
    std::vector<VertexId> number(at_.size(), kNone);
    for (const auto& t : triangles_) {
      if (t[0] == kNone) continue;
      std::array<VertexId, 3> corners{};
      for (std::size_t i = 0; i < 3; ++i) {
        if (number[t[i]] == kNone) {
          number[t[i]] = static_cast<VertexId>(out.vertices_body_m.size());
          out.vertices_body_m.push_back(at_[t[i]]);
        }
        corners[i] = number[t[i]];
      }
      out.triangles.push_back(corners);
    }
    return out;
  }

 private:
  struct Edge {
    double length_m;
    VertexId a, b;
    bool operator<(const Edge& o) const { return std::tie(length_m, a, b) < std::tie(o.length_m, o.a, o.b); }
  };

  double length_m(VertexId a, VertexId b) const { return (at_[a] - at_[b]).norm(); }
  Vec3 area_vector(const std::array<VertexId, 3>& t) const {
    return (at_[t[1]] - at_[t[0]]).cross(at_[t[2]] - at_[t[0]]);
  }

  std::vector<Edge> edges() const {
    std::vector<Edge> all;
    for (const auto& t : triangles_)
      for (std::size_t i = 0; i < 3 && t[0] != kNone; ++i)
        if (t[i] < t[(i + 1) % 3]) all.push_back({length_m(t[i], t[(i + 1) % 3]), t[i], t[(i + 1) % 3]});
    return all;
  }

  // The triangle with the edge a -> b in this direction, and its third corner.
  struct Side {
    std::uint32_t triangle = kNone;
    VertexId across = kNone;
  };
  Side side(VertexId a, VertexId b) const {
    for (const std::uint32_t t : around_[a])
      for (std::size_t i = 0; i < 3; ++i)
        if (triangles_[t][i] == a && triangles_[t][(i + 1) % 3] == b) return {t, triangles_[t][(i + 2) % 3]};
    return {};
  }
  std::vector<VertexId> neighbours(VertexId v) const {
    std::vector<VertexId> all;
    for (const std::uint32_t t : around_[v])
      for (const VertexId w : triangles_[t])
        if (w != v) all.push_back(w);
    sort_unique(all);
    return all;
  }
  int valence(VertexId v) const { return static_cast<int>(around_[v].size()); }

  void replace(std::uint32_t t, const std::array<VertexId, 3>& corners) {
    if (triangles_[t][0] != kNone)
      for (const VertexId v : triangles_[t]) std::erase(around_[v], t);
    triangles_[t] = corners;
    if (corners[0] != kNone)
      for (const VertexId v : corners) around_[v].push_back(t);
  }

  void split_long() {
    std::vector<Edge> long_edges = edges();
    std::erase_if(long_edges, [&](const Edge& e) { return e.length_m <= kLong * edge_m_; });
    std::ranges::sort(long_edges, std::greater<>(), &Edge::length_m);
    for (const Edge& e : long_edges) {
      const Side left = side(e.a, e.b), right = side(e.b, e.a);
      if (left.triangle == kNone || right.triangle == kNone) continue;
      const auto m = static_cast<VertexId>(at_.size());
      at_.push_back(0.5 * (at_[e.a] + at_[e.b]));
      around_.emplace_back();
      replace(left.triangle, {e.a, m, left.across});
      replace(right.triangle, {e.b, m, right.across});
      for (const std::array<VertexId, 3>& corners :
           {std::array{m, e.b, left.across}, std::array{m, e.a, right.across}}) {
        triangles_.push_back({kNone, kNone, kNone});
        replace(static_cast<std::uint32_t>(triangles_.size() - 1), corners);
      }
    }
  }

  // b becomes a, in the middle of both, where the surface stays a manifold and no triangle turns over.
  bool collapse(VertexId a, VertexId b, double longest_m) {
    const Side left = side(a, b), right = side(b, a);
    if (left.triangle == kNone || right.triangle == kNone || left.across == right.across) return false;
    const std::vector<VertexId> near_a = neighbours(a), near_b = neighbours(b);
    std::vector<VertexId> common;
    std::ranges::set_intersection(near_a, near_b, std::back_inserter(common));
    if (common.size() != 2 || valence(left.across) <= 4 || valence(right.across) <= 4) return false;
    if (valence(a) + valence(b) > 13) return false;
    const Vec3 middle = 0.5 * (at_[a] + at_[b]), old_a = at_[a], old_b = at_[b];
    for (const auto& near : {near_a, near_b})
      for (const VertexId v : near)
        if (v != a && v != b && (at_[v] - middle).norm() > longest_m) return false;
    std::vector<std::pair<std::uint32_t, Vec3>> before;
    for (const VertexId v : {a, b})
      for (const std::uint32_t t : around_[v])
        if (t != left.triangle && t != right.triangle) before.emplace_back(t, area_vector(triangles_[t]).normalized());
    at_[a] = at_[b] = middle;
    const bool turns = std::ranges::any_of(before, [&](const auto& was) {
      const Vec3 now = area_vector(triangles_[was.first]);
      return !(now.dot(was.second) > kSameSide * now.norm());
    });
    if (turns) {
      at_[a] = old_a;
      at_[b] = old_b;
      return false;
    }
    replace(left.triangle, {kNone, kNone, kNone});
    replace(right.triangle, {kNone, kNone, kNone});
    for (const std::uint32_t t : std::vector<std::uint32_t>(around_[b])) {
      std::array<VertexId, 3> corners = triangles_[t];
      std::ranges::replace(corners, b, a);
      replace(t, corners);
    }
    return true;
  }

  void collapse_short(double shortest_m) {
    std::vector<Edge> short_edges = edges();
    std::erase_if(short_edges, [&](const Edge& e) { return e.length_m >= shortest_m; });
    std::sort(short_edges.begin(), short_edges.end());
    for (const Edge& e : short_edges)
      if (length_m(e.a, e.b) < shortest_m) collapse(e.a, e.b, kLong * edge_m_);
  }

  double smallest_angle(const std::array<VertexId, 3>& t) const {
    double least = M_PI;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 u = at_[t[(i + 1) % 3]] - at_[t[i]], v = at_[t[(i + 2) % 3]] - at_[t[i]];
      least = std::min(least, std::atan2(u.cross(v).norm(), u.dot(v)));
    }
    return least;
  }

  // It flips only when that brings valences closer to six, or makes the smallest of poor angles larger.
  bool flip(VertexId a, VertexId b) {
    const Side left = side(a, b), right = side(b, a);
    if (left.triangle == kNone || right.triangle == kNone) return false;
    const VertexId c = left.across, d = right.across;
    if (c == d || valence(a) <= 4 || valence(b) <= 4 || side(c, d).triangle != kNone || side(d, c).triangle != kNone)
      return false;
    const std::array<VertexId, 3> t{c, a, d}, u{d, b, c};
    const Vec3 before = (area_vector(triangles_[left.triangle]) + area_vector(triangles_[right.triangle])).normalized();
    for (const auto& made : {t, u})
      if (const Vec3 normal = area_vector(made); !(normal.dot(before) > 0.8 * normal.norm())) return false;
    const auto off = [&](VertexId v, int change) { return std::abs(valence(v) + change - 6); };
    const int gain = off(a, 0) + off(b, 0) + off(c, 0) + off(d, 0) - off(a, -1) - off(b, -1) - off(c, 1) - off(d, 1);
    const double was = std::min(smallest_angle(triangles_[left.triangle]), smallest_angle(triangles_[right.triangle]));
    const double is = std::min(smallest_angle(t), smallest_angle(u));
    if (!(gain > 0 && is > std::min(was, kPoor_rad)) && !(was < kPoor_rad && is > was)) return false;
    replace(left.triangle, t);
    replace(right.triangle, u);
    return true;
  }
  void flip() {
    for (const Edge& e : edges()) flip(e.a, e.b);
  }

  Vec3 normal_at(VertexId v) const {
    Vec3 normal = Vec3::Zero();
    for (const std::uint32_t t : around_[v]) normal += area_vector(triangles_[t]);
    return normal.stableNormalized();
  }

  // Towards the middle of its neighbours within the tangent plane, then onto the surface.
  void relax(const SurfaceField& surface) {
    for (VertexId v = 0; v < at_.size(); ++v) {
      if (around_[v].empty()) continue;
      Vec3 middle = Vec3::Zero();
      for (const std::uint32_t t : around_[v])
        for (const VertexId w : triangles_[t])
          if (w != v) middle += at_[w];
      middle /= 2.0 * valence(v);
      const Vec3 normal = normal_at(v), old = at_[v];
      std::vector<Vec3> before;
      for (const std::uint32_t t : around_[v]) before.push_back(area_vector(triangles_[t]).normalized());
      Vec3 move = middle - old;
      move -= move.dot(normal) * normal;
      for (double share = 1; share > 0.2; share /= 2) {
        at_[v] = surface.closest(old + share * move);
        std::size_t n = 0;
        const bool turns = std::ranges::any_of(around_[v], [&](std::uint32_t t) {
          const Vec3 now = area_vector(triangles_[t]);
          return !(now.dot(before[n++]) > kSameSide * now.norm());
        });
        if (!turns) break;
        at_[v] = old;
      }
    }
  }

  void mend_poor() {
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (triangles_[t][0] == kNone || smallest_angle(triangles_[t]) > kPoor_rad) continue;
      std::array<Edge, 3> mine{};
      for (std::size_t i = 0; i < 3; ++i) {
        const VertexId a = triangles_[t][i], b = triangles_[t][(i + 1) % 3];
        mine[i] = {length_m(a, b), a, b};
      }
      std::sort(mine.begin(), mine.end());
      if (!flip(mine[2].a, mine[2].b)) collapse(mine[0].a, mine[0].b, 2 * edge_m_);
    }
  }

  std::vector<Vec3> at_;
  std::vector<std::array<VertexId, 3>> triangles_;  // dead ones have kNone
  std::vector<std::vector<std::uint32_t>> around_;  // triangles, by vertex
  double edge_m_;
};

}  // namespace

TriangleSoup remeshed(const TriangleSoup& surface, double edge_m, int rounds) {
  Remesher remesher(surface, edge_m);
  remesher.run(SurfaceField(surface), rounds);
  return remesher.soup();
}

double smallest_angle_rad(const TriangleSoup& surface) {
  double least = M_PI;
  for (const auto& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& p = surface.vertices_body_m[t[i]];
      const Vec3 u = surface.vertices_body_m[t[(i + 1) % 3]] - p, v = surface.vertices_body_m[t[(i + 2) % 3]] - p;
      least = std::min(least, std::atan2(u.cross(v).norm(), u.dot(v)));
    }
  return least;
}

}  // namespace sectio
