#include "sim_server/scene/mesh_mend.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "common/math/hash.h"
#include "common/math/solid_angle.h"
#include "common/mesh/enclosed_volume.h"

namespace sectio {
namespace {

using CornerIds = std::array<VertexId, 3>;

// Maps each vertex to the first one within the tolerance. Cells of the grid are wide against the tolerance, so that few
// vertices have to look into a second one.
class Welder {
 public:
  Welder(const std::vector<Vec3>& position, double tolerance)
      : position_(position), tolerance_(tolerance), cell_(8 * tolerance), next_(position.size(), kNone) {}

  std::vector<VertexId> run() {
    std::vector<VertexId> target(position_.size());
    for (VertexId v = 0; v < position_.size(); ++v) {
      target[v] = find(position_[v]);
      if (target[v] != kNone) continue;
      target[v] = v;
      const auto [head, is_new] = head_.try_emplace(key(cell_of(position_[v])), v);
      if (is_new) continue;
      next_[v] = head->second;
      head->second = v;
    }
    return target;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;

  Cell cell_of(const Vec3& p) const {
    const auto index = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell_)); };
    return {index(p.x()), index(p.y()), index(p.z())};
  }
  static std::uint64_t key(const Cell& c) {
    std::uint64_t h = 0;
    for (const std::int64_t i : c) h = hash_combine(h, static_cast<std::uint64_t>(i));
    return h;
  }

  VertexId find(const Vec3& p) const {
    const Vec3 reach = Vec3::Constant(tolerance_);
    const Cell low = cell_of(p - reach), high = cell_of(p + reach);
    VertexId found = kNone;
    for (std::int64_t i = low[0]; i <= high[0]; ++i) {
      for (std::int64_t j = low[1]; j <= high[1]; ++j) {
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto head = head_.find(key({i, j, k}));
          if (head == head_.end()) continue;
          for (VertexId v = head->second; v != kNone; v = next_[v]) {
            if ((position_[v] - p).norm() <= tolerance_) found = std::min(found, v);
          }
        }
      }
    }
    return found;
  }

  const std::vector<Vec3>& position_;
  double tolerance_, cell_;
  std::unordered_map<std::uint64_t, VertexId> head_;  // by cell; only looked up, never iterated
  std::vector<VertexId> next_;
};

double diagonal(const std::vector<Vec3>& position) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : position) box.extend(p);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

std::size_t weld(TriangleSoup& soup) {
  const double tolerance = kWeldFraction * diagonal(soup.vertices_body_m);
  if (!(tolerance > 0)) return 0;
  const std::vector<VertexId> target = Welder(soup.vertices_body_m, tolerance).run();
  for (CornerIds& t : soup.triangles) {
    for (VertexId& v : t) v = target[v];
  }
  // Exact copies aren't worth a word: STL and glTF have them by design.
  std::size_t moved = 0;
  for (VertexId v = 0; v < target.size(); ++v) moved += soup.vertices_body_m[target[v]] != soup.vertices_body_m[v];
  return moved;
}

std::size_t drop_degenerate(TriangleSoup& soup) {
  return std::erase_if(soup.triangles, [](const CornerIds& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

// Keeps the first of triangles with the same three corners.
std::size_t drop_duplicates(TriangleSoup& soup) {
  std::vector<std::pair<CornerIds, std::uint32_t>> sorted;
  sorted.reserve(soup.triangles.size());
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    CornerIds corners = soup.triangles[t];
    std::sort(corners.begin(), corners.end());
    sorted.emplace_back(corners, t);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::uint8_t> drop(soup.triangles.size(), 0);
  for (std::size_t i = 1; i < sorted.size(); ++i) drop[sorted[i].second] = sorted[i].first == sorted[i - 1].first;
  std::uint32_t t = 0;
  return std::erase_if(soup.triangles, [&](const CornerIds&) { return drop[t++] != 0; });
}

void drop_unused_vertices(TriangleSoup& soup) {
  std::vector<VertexId> new_id(soup.vertices_body_m.size(), kNone);
  for (const CornerIds& t : soup.triangles) {
    for (const VertexId v : t) new_id[v] = 0;
  }
  VertexId count = 0;
  for (VertexId v = 0; v < new_id.size(); ++v) {
    if (new_id[v] == kNone) continue;
    soup.vertices_body_m[count] = soup.vertices_body_m[v];
    new_id[v] = count++;
  }
  soup.vertices_body_m.resize(count);
  for (CornerIds& t : soup.triangles) {
    for (VertexId& v : t) v = new_id[v];
  }
}

class Orienter {
 public:
  explicit Orienter(TriangleSoup& soup) : soup_(soup), component_(soup.triangles.size(), kNone) {}

  // The number of triangles that were turned.
  std::size_t run() {
    const std::vector<CornerIds> before = soup_.triangles;
    collect_edges();
    for (std::uint32_t t = 0; t < soup_.triangles.size(); ++t) {
      if (component_[t] == kNone) members_.push_back(flood(t));
    }
    for (std::uint32_t c = 0; c < members_.size(); ++c) turn_outward(c);
    std::size_t turned = 0;
    for (std::size_t t = 0; t < before.size(); ++t) turned += before[t] != soup_.triangles[t];
    return turned;
  }

 private:
  struct HalfEdge {
    VertexId low, high;
    std::uint32_t triangle;
    bool operator<(const HalfEdge& o) const {
      return std::tie(low, high, triangle) < std::tie(o.low, o.high, o.triangle);
    }
  };

  // across_[3 t + i]: the triangle beyond edge i of t where exactly two triangles meet, else kNone.
  void collect_edges() {
    std::vector<HalfEdge> edges;
    edges.reserve(3 * soup_.triangles.size());
    for (std::uint32_t t = 0; t < soup_.triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [low, high] = edge(t, i);
        edges.push_back({low, high, t});
      }
    }
    std::sort(edges.begin(), edges.end());
    across_.assign(edges.size(), kNone);
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
      while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
      if (end - begin != 2) continue;
      set_across(edges[begin], edges[begin + 1].triangle);
      set_across(edges[begin + 1], edges[begin].triangle);
    }
  }

  std::pair<VertexId, VertexId> edge(std::uint32_t t, std::size_t i) const {
    const VertexId a = soup_.triangles[t][i], b = soup_.triangles[t][(i + 1) % 3];
    return {std::min(a, b), std::max(a, b)};
  }
  void set_across(const HalfEdge& e, std::uint32_t other) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (edge(e.triangle, i) == std::pair(e.low, e.high)) across_[3 * std::size_t{e.triangle} + i] = other;
    }
  }

  bool runs(std::uint32_t t, VertexId a, VertexId b) const {
    const CornerIds& c = soup_.triangles[t];
    return (c[0] == a && c[1] == b) || (c[1] == a && c[2] == b) || (c[2] == a && c[0] == b);
  }

  std::vector<std::uint32_t> flood(std::uint32_t seed) {
    std::vector<std::uint32_t> members{seed};
    const auto label = static_cast<std::uint32_t>(members_.size());
    component_[seed] = label;
    for (std::size_t at = 0; at < members.size(); ++at) {
      const std::uint32_t t = members[at];
      // Turning a triangle moves its edges to other places, so each neighbour is looked for by its shared corners.
      for (std::size_t slot = 0; slot < 3; ++slot) {
        const std::uint32_t n = across_[3 * std::size_t{t} + slot];
        if (n == kNone || component_[n] != kNone) continue;
        component_[n] = label;
        for (std::size_t i = 0; i < 3; ++i) {
          const VertexId a = soup_.triangles[t][i], b = soup_.triangles[t][(i + 1) % 3];
          if (!runs(n, a, b)) continue;
          std::swap(soup_.triangles[n][1], soup_.triangles[n][2]);
          break;
        }
        members.push_back(n);
      }
    }
    return members;
  }

  double volume(std::uint32_t c) const {
    EnclosedVolume volume;
    for (const std::uint32_t t : members_[c]) volume.add(at(t, 0), at(t, 1), at(t, 2));
    return volume.m3();
  }
  const Vec3& at(std::uint32_t t, std::size_t i) const { return soup_.vertices_body_m[soup_.triangles[t][i]]; }

  bool contains(std::uint32_t c, const Vec3& p) const {
    double share = 0;
    for (const std::uint32_t t : members_[c]) share += share_seen_from(p, at(t, 0), at(t, 1), at(t, 2));
    return std::abs(share) > 0.5;
  }

  // Some corners are looked at, far from each other in the file: a part that crosses another has them on both sides.
  bool holds(std::uint32_t other, std::uint32_t c) const {
    constexpr std::size_t kCorners = 64;
    const std::vector<std::uint32_t>& members = members_[c];
    const std::size_t every = (members.size() + kCorners - 1) / kCorners;
    for (std::size_t n = 0; n < members.size(); n += every)
      if (!contains(other, at(members[n], 0))) return false;
    return true;
  }

  void turn_outward(std::uint32_t c) {
    constexpr std::size_t kMostForCavities = 32;  // more parts than that are no hollow organ
    bool cavity = false;
    for (std::uint32_t other = 0; other < members_.size() && members_.size() <= kMostForCavities; ++other) {
      if (other != c && holds(other, c)) cavity = !cavity;
    }
    if ((volume(c) < 0) == cavity) return;
    for (const std::uint32_t t : members_[c]) std::swap(soup_.triangles[t][1], soup_.triangles[t][2]);
  }

  TriangleSoup& soup_;
  std::vector<std::uint32_t> across_;
  std::vector<std::uint32_t> component_;
  std::vector<std::vector<std::uint32_t>> members_;
};

}  // namespace

std::vector<std::string> mend(TriangleSoup& soup) {
  std::vector<std::string> done;
  const auto note = [&](std::size_t count, const char* what) {
    if (count > 0) done.push_back(std::to_string(count) + " " + what);
  };
  note(weld(soup), "vertices welded to one less than a millionth of the size away");
  note(drop_degenerate(soup), "triangles of no area dropped");
  note(drop_duplicates(soup), "duplicate triangles dropped");
  drop_unused_vertices(soup);
  note(Orienter(soup).run(), "triangles turned outward");
  return done;
}

}  // namespace sectio
