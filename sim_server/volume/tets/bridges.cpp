#include "sim_server/volume/tets/bridges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

// The cheapest set of arcs that parts a source from a sink, as the flow that saturates it (Edmonds and Karp): few faces
// hold the sides of a slit together, so that few paths do.
class Network {
 public:
  explicit Network(std::size_t nodes) : arcs_of_(nodes) {}

  void join(std::uint32_t a, std::uint32_t b, double capacity) {
    arcs_of_[a].push_back(static_cast<std::uint32_t>(arcs_.size()));
    arcs_.push_back({b, capacity});
    arcs_of_[b].push_back(static_cast<std::uint32_t>(arcs_.size()));
    arcs_.push_back({a, capacity});
  }

  // True for nodes that remain with the source.
  std::vector<char> part(std::uint32_t source, std::uint32_t sink) {
    for (;;) {
      std::vector<std::uint32_t> by(arcs_of_.size(), kNone);  // the arc by which a node was reached
      std::vector<char> with_source(arcs_of_.size(), 0);
      std::vector<std::uint32_t> reached{source};
      with_source[source] = 1;
      for (std::size_t k = 0; k < reached.size() && !with_source[sink]; ++k)
        for (const std::uint32_t a : arcs_of_[reached[k]]) {
          const std::uint32_t to = arcs_[a].to;
          if (!(arcs_[a].left > 0) || with_source[to]) continue;
          with_source[to] = 1;
          by[to] = a;
          reached.push_back(to);
        }
      if (!with_source[sink]) return with_source;
      double flow = std::numeric_limits<double>::infinity();
      for (std::uint32_t at = sink; at != source; at = arcs_[by[at] ^ 1].to) flow = std::min(flow, arcs_[by[at]].left);
      for (std::uint32_t at = sink; at != source; at = arcs_[by[at] ^ 1].to) {
        arcs_[by[at]].left -= flow;
        arcs_[by[at] ^ 1].left += flow;
      }
    }
  }

 private:
  struct Arc {
    std::uint32_t to;
    double left;  // can flow in addition; the arc back has the next number, or the one before
  };
  std::vector<Arc> arcs_;
  std::vector<std::vector<std::uint32_t>> arcs_of_;
};

class Bridges {
 public:
  Bridges(TetTopology& volume, const HeightOverCut& height_m, double side_m, std::span<const std::uint32_t> begin)
      : volume_(volume), height_m_(height_m), side_m_(side_m) {
    for (const std::uint32_t t : begin) add(t);
    for (std::size_t k = 0; k < around_.size(); ++k)
      for (std::size_t corner = 0; corner < 4; ++corner)
        if (const std::uint32_t u = volume_.across(around_[k], corner); u != kNone) add(u);
  }

  void part_sides() {
    const auto source = static_cast<std::uint32_t>(around_.size()), sink = source + 1;
    Network network(around_.size() + 2);
    for (std::uint32_t k = 0; k < source; ++k) {
      if (side_[k] != 0) network.join(k, side_[k] > 0 ? source : sink, std::numeric_limits<double>::infinity());
      for (std::size_t corner = 0; corner < 4; ++corner) {
        const auto beyond = number_.find(volume_.across(around_[k], corner));
        if (beyond == number_.end() || beyond->second < k || !may_part(k, corner, beyond->second)) continue;
        const Tetrahedron& v = volume_.tetrahedra()[around_[k]];
        const auto& [a, b, c] = kTetFaces[corner];
        network.join(k, beyond->second, volume_.face_m2(v[a], v[b], v[c]));
      }
    }
    is_above_ = network.part(source, sink);
  }

  std::vector<VertexId> open() {
    std::vector<VertexId> vertices;
    for (const std::uint32_t t : around_)
      for (std::size_t corner = 0; corner < 4; ++corner)
        if (const std::uint32_t u = volume_.across(t, corner); u != kNone && is_bridge(t, corner, u))
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
  void add(std::uint32_t t) {
    if (number_.contains(t)) return;
    Vec3 middle = Vec3::Zero();
    for (const VertexId v : volume_.tetrahedra()[t]) middle += 0.25 * volume_.vertex(v).rest_body_m;
    const std::optional<double> height = height_m_(middle);
    if (!height) return;
    number_[t] = static_cast<std::uint32_t>(around_.size());
    around_.push_back(t);
    side_.push_back(*height > side_m_ ? 1 : *height < -side_m_ ? -1 : 0);
  }
  // Two tetrahedra that lie far from the surface, on its two sides, and share a face do so beyond its outline. So do
  // those that reach beneath the blade with a face that lies there. The same from both sides of the face.
  bool may_part(std::uint32_t k, std::size_t corner, std::uint32_t l) const {
    if (side_[k] != 0 && side_[l] != 0) return false;
    std::array<VertexId, 3> face{};
    std::ranges::transform(kTetFaces[corner], face.begin(),
                           [&](std::size_t i) { return volume_.tetrahedra()[around_[k]][i]; });
    std::ranges::sort(face);
    Vec3 middle = Vec3::Zero();
    for (const VertexId v : face) middle += volume_.vertex(v).rest_body_m / 3;
    return height_m_(middle).has_value();
  }
  bool is_bridge(std::uint32_t t, std::size_t corner, std::uint32_t u) const {
    const auto at = number_.find(t), beyond = number_.find(u);
    return at != number_.end() && beyond != number_.end() && is_above_[at->second] != is_above_[beyond->second] &&
           may_part(at->second, corner, beyond->second);
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
          if (u == kNone || found == left.end() || is_bridge(component[k], corner, u)) continue;
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
  const HeightOverCut& height_m_;
  std::vector<std::uint32_t> around_;
  double side_m_;
  std::vector<int> side_;       // 1 or -1: far from the surface, for certain on this side of it
  std::vector<char> is_above_;  // on the positive side
  std::unordered_map<std::uint32_t, std::uint32_t> number_;  // its place in `around_`; never iterated
};

}  // namespace

std::vector<VertexId> open_bridges(TetTopology& volume, const HeightOverCut& height_m, double side_m,
                                   std::span<const std::uint32_t> begin) {
  Bridges bridges(volume, height_m, side_m, begin);
  bridges.part_sides();
  return bridges.open();
}

}  // namespace sectio
