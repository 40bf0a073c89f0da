#include "sim_server/volume/tets/bridges.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

class Bridges {
 public:
  Bridges(TetTopology& volume, const HeightOverCut& height_m, std::span<const std::uint32_t> begin) : volume_(volume) {
    for (const std::uint32_t t : begin) add(t, height_m);
    for (std::size_t k = 0; k < around_.size(); ++k)
      for (std::size_t corner = 0; corner < 4; ++corner)
        if (const std::uint32_t u = volume_.across(around_[k], corner); u != kNone) add(u, height_m);
  }

  void grow_sides(double side_m) {
    std::priority_queue<std::tuple<double, std::uint32_t>> next;
    for (const std::uint32_t t : around_)
      if (std::abs(height_m_[t]) > side_m) {
        side_[t] = height_m_[t] > 0 ? 1 : -1;
        next.emplace(std::abs(height_m_[t]), t);
      }
    while (!next.empty()) {
      const std::uint32_t t = std::get<1>(next.top());
      next.pop();
      for (std::size_t corner = 0; corner < 4; ++corner) {
        const std::uint32_t u = volume_.across(t, corner);
        if (u == kNone || !height_m_.contains(u) || !side_.emplace(u, side_[t]).second) continue;
        next.emplace(std::abs(height_m_[u]), u);
      }
    }
  }

  std::vector<VertexId> open() {
    std::vector<VertexId> vertices;
    for (const std::uint32_t t : around_)
      for (std::size_t corner = 0; corner < 4; ++corner)
        if (const std::uint32_t u = volume_.across(t, corner); u != kNone && is_bridge(t, u))
          for (std::size_t k = 0; k < 4; ++k)
            if (k != corner) vertices.push_back(volume_.tetrahedra()[t][k]);
    sort_unique(vertices);
    const std::size_t before = vertices.size();
    for (std::size_t k = 0; k < before; ++k)
      for (const auto& component : further_components(vertices[k]))
        vertices.push_back(volume_.part(vertices[k], component));
    if (vertices.size() == before) return {};
    sort_unique(vertices);
    return vertices;
  }

 private:
  void add(std::uint32_t t, const HeightOverCut& height_m) {
    if (height_m_.contains(t)) return;
    Vec3 middle = Vec3::Zero();
    for (const VertexId v : volume_.tetrahedra()[t]) middle += 0.25 * volume_.vertex(v).rest_body_m;
    const std::optional<double> height = height_m(middle);
    if (!height) return;
    height_m_[t] = *height;
    around_.push_back(t);
  }
  bool is_bridge(std::uint32_t t, std::uint32_t u) const {
    const auto at = side_.find(t), beyond = side_.find(u);
    return at != side_.end() && beyond != side_.end() && at->second != beyond->second;
  }
  // The components of the tetrahedra at v, connected through faces that stay closed; without that of the first.
  std::vector<std::vector<std::uint32_t>> further_components(VertexId v) const {
    std::vector<std::uint32_t> left(volume_.star(v).begin(), volume_.star(v).end());
    std::vector<std::vector<std::uint32_t>> components;
    while (!left.empty()) {
      std::vector<std::uint32_t> component{left.front()};
      left.erase(left.begin());
      for (std::size_t k = 0; k < component.size(); ++k)
        for (std::size_t corner = 0; corner < 4; ++corner) {
          const std::uint32_t u = shared_across(component[k], corner, v);
          const auto found = std::ranges::find(left, u);
          if (u == kNone || found == left.end() || is_bridge(component[k], u)) continue;
          component.push_back(u);
          left.erase(found);
        }
      components.push_back(std::move(component));
    }
    components.erase(components.begin());
    return components;
  }
  // Beyond a face that has v.
  std::uint32_t shared_across(std::uint32_t t, std::size_t corner, VertexId v) const {
    return volume_.tetrahedra()[t][corner] == v ? kNone : volume_.across(t, corner);
  }

  TetTopology& volume_;
  std::vector<std::uint32_t> around_;
  std::unordered_map<std::uint32_t, double> height_m_;  // never iterated
  std::unordered_map<std::uint32_t, int> side_;         // never iterated
};

}  // namespace

std::vector<VertexId> open_bridges(TetTopology& volume, const HeightOverCut& height_m, double side_m,
                                   std::span<const std::uint32_t> begin) {
  Bridges bridges(volume, height_m, begin);
  bridges.grow_sides(side_m);
  return bridges.open();
}

}  // namespace sectio
