#include "sim_server/surface/cutting/slit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sim_server/surface/cutting/templates.h"

namespace sectio {
namespace {

double twice_area(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// Triangulates a wall, a clockwise polygon of rim indices: along the verticals first, then ear after ear, the roundest
// ear first. No inner edge joins two single vertices, because both walls would have that edge.
class WallDivision {
 public:
  explicit WallDivision(const Slit& slit) : slit_(slit) {}

  std::vector<std::array<std::size_t, 3>> run() {
    std::vector<std::size_t> all(slit_.rim.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    std::vector<std::vector<std::size_t>> open{all};
    for (const auto& [a, b] : slit_.verticals) cut_along(open, a, b);
    for (auto& polygon : open) clip_ears(polygon);
    return std::move(result_);
  }

 private:
  const Vec2& at(std::size_t i) const { return slit_.rim[i].at; }

  static void cut_along(std::vector<std::vector<std::size_t>>& polygons, std::size_t a, std::size_t b) {
    for (std::size_t k = 0; k < polygons.size(); ++k) {
      std::vector<std::size_t>& p = polygons[k];
      const auto ia = std::find(p.begin(), p.end(), a);
      if (ia == p.end() || std::find(p.begin(), p.end(), b) == p.end()) continue;
      std::rotate(p.begin(), ia, p.end());
      const auto ib = std::find(p.begin(), p.end(), b);
      const auto n = ib - p.begin();
      if (n < 2 || n > static_cast<std::ptrdiff_t>(p.size()) - 2) return;  // already an edge of the polygon
      std::vector<std::size_t> rest(ib, p.end());
      rest.push_back(a);
      p.erase(ib + 1, p.end());
      polygons.push_back(std::move(rest));
      return;
    }
  }

  // Roundness of an ear: twice the area over the longest side squared; negative when it is not an ear.
  double quality(const std::vector<std::size_t>& p, std::size_t i) const {
    const std::size_t n = p.size(), h = p[(i + n - 1) % n], j = p[(i + 1) % n];
    if (!slit_.rim[h].pair() && !slit_.rim[j].pair() && n > 3) return -1e9;
    const double area = -twice_area(at(h), at(p[i]), at(j));
    const double longest =
        std::max({(at(p[i]) - at(h)).squaredNorm(), (at(j) - at(p[i])).squaredNorm(), (at(h) - at(j)).squaredNorm()});
    // Equally round ears, as in a rectangle, are ordered by their place, so that the choice doesn't depend on where the
    // cut was interrupted.
    const Vec2 aside = (at(p[i]) - at(p[(i + 1) % n]) + at(p[i]) - at(h)) / std::sqrt(std::max(longest, 1e-300));
    double q = longest > 0 ? area / longest - 1e-3 * aside.x() + 1e-4 * aside.y() : 0;
    if (area <= 0) q = std::min(q, 0.0);
    for (std::size_t k = 0; k < n && q > 0; ++k) {
      const std::size_t x = p[k];
      if (x == h || x == p[i] || x == j) continue;
      if (twice_area(at(h), at(p[i]), at(x)) <= 0 && twice_area(at(p[i]), at(j), at(x)) <= 0 &&
          twice_area(at(j), at(h), at(x)) <= 0)
        q = -1;
    }
    return q;
  }

  void clip_ears(std::vector<std::size_t>& p) {
    while (p.size() > 3) {
      std::size_t best = 0;
      double best_quality = -1e300;
      for (std::size_t i = 0; i < p.size(); ++i) {
        const double q = quality(p, i);
        if (q > best_quality) best_quality = q, best = i;
      }
      const std::size_t n = p.size();
      result_.push_back({p[(best + n - 1) % n], p[best], p[(best + 1) % n]});
      p.erase(p.begin() + static_cast<std::ptrdiff_t>(best));
    }
    if (p.size() == 3) result_.push_back({p[0], p[1], p[2]});
  }

  const Slit& slit_;
  std::vector<std::array<std::size_t, 3>> result_;
};

void add_wall(std::vector<Triangle>& out, VertexId a, VertexId b, VertexId c) {
  if (a != b && b != c && c != a) out.push_back({{a, b, c}, Surface::wall});
}

// Adds both walls and the bottom.
void fill(const Slit& slit, std::vector<Triangle>& out) {
  const auto& rim = slit.rim;
  for (const auto& [i, j, k] : WallDivision(slit).run()) {
    add_wall(out, rim[i].right, rim[j].right, rim[k].right);
    add_wall(out, rim[k].left, rim[j].left, rim[i].left);
  }
  for (std::size_t i = 0; i < rim.size(); ++i) {
    if (!rim[i].bottom_follows) continue;
    const SlitNode &a = rim[i], &b = rim[(i + 1) % rim.size()];
    add_wall(out, a.left, b.left, b.right);
    add_wall(out, a.left, b.right, a.right);
  }
  out.insert(out.end(), slit.new_bottoms.begin(), slit.new_bottoms.end());
}

// Do all triangles of a vertex form one ring, with at least three triangles and no neighbour twice?
bool ring_holds(const MeshDraft& draft, VertexId v, std::size_t triangles) {
  const std::vector<TriangleId> fan = draft.fan(v);
  if (fan.size() < 3 || fan.size() != triangles) return false;
  std::set<VertexId> neighbours;
  for (const TriangleId t : fan)
    if (!neighbours.insert(draft.triangle(t).after(v)).second) return false;
  return true;
}

}  // namespace

bool open_slits(MeshDraft& draft, std::span<const Slit> slits) {
  std::map<TriangleId, Triangle> changed;  // dead: removed
  for (const Slit& slit : slits)
    for (const Triangle& bottom : slit.old_bottoms) {
      const TriangleId t = draft.find_triangle(bottom.v[0], bottom.v[1], bottom.v[2]);
      if (t == kNone) return false;
      changed[t] = Triangle{};
    }
  std::set<VertexId> seen;
  for (const Slit& slit : slits)
    for (const SlitNode& node : slit.rim) {
      if (!seen.insert(node.left).second) return false;  // the path touches itself
      if (node.path_from == kNone) continue;
      const std::vector<TriangleId> right = right_of_path(draft, node.path_from, node.left, node.path_to);
      if (right.empty()) return false;
      for (const TriangleId t : right) {
        Triangle& triangle = changed.try_emplace(t, draft.triangle(t)).first->second;
        if (triangle.alive()) std::replace(triangle.v.begin(), triangle.v.end(), node.left, node.right);
      }
    }
  std::vector<TriangleId> removed, discarded;
  std::vector<Triangle> added;
  for (const auto& [t, triangle] : changed) {
    (triangle.alive() ? removed : discarded).push_back(t);
    if (triangle.alive()) added.push_back(triangle);
  }
  removed.insert(removed.end(), discarded.begin(), discarded.end());
  for (const Slit& slit : slits) fill(slit, added);

  std::map<VertexId, std::size_t> uses;  // triangles around each vertex afterwards
  for (const Triangle& triangle : added)
    for (const VertexId v : triangle.v) ++uses[v];
  for (const TriangleId t : removed)
    for (const VertexId v : draft.triangle(t).v) uses.try_emplace(v, 0);
  for (auto& [v, count] : uses)
    for (const TriangleId t : draft.fan(v)) count += !changed.contains(t);
  if (!draft.replace(removed, added)) return false;
  return std::all_of(uses.begin(), uses.end(), [&](const auto& use) {
    return use.second == 0 ? draft.incident(use.first) == kNone : ring_holds(draft, use.first, use.second);
  });
}

}  // namespace sectio
