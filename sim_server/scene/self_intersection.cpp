#include "sim_server/scene/self_intersection.h"

#include <algorithm>
#include <numeric>
#include <optional>

namespace sectio {
namespace {

using CornerIds = std::array<VertexId, 3>;
using Points = std::array<Vec3, 3>;

// Sign of the volume of (a, b, c, d); 0 within the rounding of the expression, bounded by its permanent
// (Shewchuk 1997, section 4.4, with a wider constant for inputs that were transformed).
int side(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = a - d, v = b - d, w = c - d;
  const double determinant = u.dot(v.cross(w));
  const auto permanent = [&](int i, int j, int k) {
    return std::abs(u[i]) * (std::abs(v[j] * w[k]) + std::abs(v[k] * w[j]));
  };
  const double bound = 4e-15 * (permanent(0, 1, 2) + permanent(1, 2, 0) + permanent(2, 0, 1));
  return determinant > bound ? 1 : determinant < -bound ? -1 : 0;
}

// The point at which the segment pq meets the triangle, its border included; nothing when they are coplanar (see
// flat_overlap).
std::optional<Vec3> segment_meets(const Vec3& p, const Vec3& q, const Points& t) {
  const int side_p = side(t[0], t[1], t[2], p), side_q = side(t[0], t[1], t[2], q);
  if (side_p == side_q) return {};
  const int s0 = side(p, q, t[0], t[1]), s1 = side(p, q, t[1], t[2]), s2 = side(p, q, t[2], t[0]);
  const bool inside = (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
  if (!inside) return {};
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double dp = std::abs(normal.dot(p - t[0])), dq = std::abs(normal.dot(q - t[0]));
  return dp + dq > 0 ? p + dp / (dp + dq) * (q - p) : p;
}

// Triangles in one plane: do their insides overlap? Separating lines along the edges of both, after projection.
bool flat_overlap(const Points& a, const Points& b) {
  const Vec3 normal = (a[1] - a[0]).cross(a[2] - a[0]);
  int drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  const int x = (drop + 1) % 3, y = (drop + 2) % 3;
  const auto area = [&](const Vec3& p, const Vec3& q, const Vec3& r) {
    return (q[x] - p[x]) * (r[y] - p[y]) - (q[y] - p[y]) * (r[x] - p[x]);
  };
  const auto separates = [&](const Points& s, const Points& other) {
    const double turn = area(s[0], s[1], s[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      const bool beyond = std::all_of(other.begin(), other.end(), [&](const Vec3& r) {
        return area(s[i], s[(i + 1) % 3], r) * (turn > 0 ? 1 : -1) <= 1e-12 * std::abs(turn);
      });
      if (beyond) return true;
    }
    return false;
  };
  return !separates(a, b) && !separates(b, a);
}

class PairTest {
 public:
  explicit PairTest(const TriangleSoup& soup) : soup_(soup) {}

  std::optional<Vec3> meet(TriangleId ta, TriangleId tb) const {
    const CornerIds &ca = soup_.triangles[ta], &cb = soup_.triangles[tb];
    const Points a = points(ca), b = points(cb);
    const bool flat = std::all_of(b.begin(), b.end(), [&](const Vec3& p) { return side(a[0], a[1], a[2], p) == 0; });
    if (flat) return flat_overlap(a, b) ? std::optional<Vec3>((b[0] + b[1] + b[2]) / 3) : std::nullopt;
    // Not in one plane: they meet in a segment, each end of which is an edge of one in the other. An edge with a
    // shared corner meets the other triangle there and need not be asked.
    if (const auto point = edges_meet(ca, a, cb, b)) return point;
    return edges_meet(cb, b, ca, a);
  }

 private:
  Points points(const CornerIds& c) const {
    return {soup_.vertices_body_m[c[0]], soup_.vertices_body_m[c[1]], soup_.vertices_body_m[c[2]]};
  }
  static std::optional<Vec3> edges_meet(const CornerIds& ca, const Points& a, const CornerIds& cb, const Points& b) {
    const auto shared = [&](VertexId v) { return std::find(cb.begin(), cb.end(), v) != cb.end(); };
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      if (shared(ca[i]) || shared(ca[j])) continue;
      if (const auto point = segment_meets(a[i], a[j], b)) return point;
    }
    return {};
  }

  const TriangleSoup& soup_;
};

// A binary tree of boxes over the triangles, halved at the median of the longest side.
class BoxTree {
 public:
  explicit BoxTree(const TriangleSoup& soup) : order_(soup.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    box_.resize(soup.triangles.size());
    for (std::size_t t = 0; t < box_.size(); ++t) {
      for (const VertexId v : soup.triangles[t]) box_[t].extend(soup.vertices_body_m[v]);
    }
    if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
  }

  // visit(a, b) for every pair of triangles whose boxes meet, until it returns false.
  template <class Visit>
  void self_pairs(Visit visit) const {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> open;
    if (!nodes_.empty()) open.emplace_back(0, 0);
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      const Node &a = nodes_[i], &b = nodes_[j];
      if (i == j && a.leaf()) {
        if (!leaf_pairs(a, a, visit)) return;
      } else if (i == j) {
        open.insert(open.end(), {{a.left, a.left}, {a.right, a.right}, {a.left, a.right}});
      } else if (!a.box.intersects(b.box)) {
        continue;
      } else if (a.leaf() && b.leaf()) {
        if (!leaf_pairs(a, b, visit)) return;
      } else if (b.leaf() || (!a.leaf() && a.end - a.begin >= b.end - b.begin)) {
        open.insert(open.end(), {{a.left, j}, {a.right, j}});
      } else {
        open.insert(open.end(), {{i, b.left}, {i, b.right}});
      }
    }
  }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t begin = 0, end = 0;
    std::uint32_t left = 0, right = 0;
    bool leaf() const { return left == 0; }
  };
  static constexpr std::uint32_t kLeafSize = 4;

  std::uint32_t build(std::uint32_t begin, std::uint32_t end) {
    const auto node = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    Eigen::AlignedBox3d box, centres;
    for (std::uint32_t k = begin; k < end; ++k) {
      box.extend(box_[order_[k]]);
      centres.extend(box_[order_[k]].center());
    }
    nodes_[node].box = box;
    nodes_[node].begin = begin;
    nodes_[node].end = end;
    if (end - begin <= kLeafSize) return node;
    int axis = 0;
    centres.sizes().maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double ca = box_[a].center()[axis], cb = box_[b].center()[axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    const std::uint32_t left = build(begin, middle), right = build(middle, end);
    nodes_[node].left = left;
    nodes_[node].right = right;
    return node;
  }

  template <class Visit>
  bool leaf_pairs(const Node& a, const Node& b, Visit& visit) const {
    for (std::uint32_t i = a.begin; i < a.end; ++i) {
      for (std::uint32_t j = &a == &b ? i + 1 : b.begin; j < b.end; ++j) {
        const TriangleId s = std::min(order_[i], order_[j]), t = std::max(order_[i], order_[j]);
        if (box_[s].intersects(box_[t]) && !visit(s, t)) return false;
      }
    }
    return true;
  }

  std::vector<std::uint32_t> order_;
  std::vector<Eigen::AlignedBox3d> box_;
  std::vector<Node> nodes_;
};

}  // namespace

SelfIntersections find_self_intersections(const TriangleSoup& soup, std::size_t max_pairs) {
  SelfIntersections found;
  const PairTest test(soup);
  // An ordinary surface has about six candidates a triangle; one with hundreds is no surface of an organ.
  std::uint64_t budget = 10'000 + 300 * std::uint64_t{soup.triangles.size()};
  BoxTree(soup).self_pairs([&](TriangleId a, TriangleId b) {
    if (budget-- == 0) return found.complete = false;
    if (const auto point = test.meet(a, b)) found.pairs.push_back({a, b, *point});
    if (found.pairs.size() >= max_pairs) return found.complete = false;
    return true;
  });
  std::sort(found.pairs.begin(), found.pairs.end(),
            [](const TrianglePair& p, const TrianglePair& q) { return std::tie(p.a, p.b) < std::tie(q.a, q.b); });
  return found;
}

}  // namespace sectio
