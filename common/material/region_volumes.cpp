#include "common/material/region_volumes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "common/mesh/check.h"

namespace sectio {
namespace {

using Corners = std::array<Vec3, 4>;

void add(RegionVolumes& volumes, std::uint32_t region, double volume_m3) {
  (region == kNoRegion ? volumes.other_m3 : volumes.region_m3[region]) += volume_m3;
}

RegionVolumes none_of(const Regions& regions) {
  return {std::vector<double>(regions.size(), 0), 0};
}

// Bisects a tetrahedron at its longest edge until each part lies in one region or is small.
void add_tetrahedron(const Regions& regions, const Corners& x, double resolution_m, RegionVolumes& volumes) {
  const Vec3 middle = (x[0] + x[1] + x[2] + x[3]) / 4;
  double radius2 = 0, longest2 = 0;
  std::array<std::size_t, 2> longest = kTetEdges[0];
  for (const Vec3& corner : x) radius2 = std::max(radius2, (corner - middle).squaredNorm());
  for (const auto& edge : kTetEdges) {
    const double length2 = (x[edge[0]] - x[edge[1]]).squaredNorm();
    if (length2 > longest2) longest2 = length2, longest = edge;
  }
  if (longest2 <= resolution_m * resolution_m || is_one_region(regions, middle, std::sqrt(radius2)))
    return add(volumes, region_at(regions, middle), tet_volume_m3(x[0], x[1], x[2], x[3]));
  const Vec3 half = 0.5 * (x[longest[0]] + x[longest[1]]);
  for (const std::size_t end : longest) {
    Corners part = x;
    part[end] = half;
    add_tetrahedron(regions, part, resolution_m, volumes);
  }
}

// The intervals in which vertical lines of a grid lie inside a surface.
class Columns {
 public:
  Columns(std::span<const Vec3> vertices, std::span<const Triangle> triangles, double step_m)
      : vertices_(vertices), step_m_(step_m) {
    for (const Triangle& t : triangles) {
      if (!t.alive()) continue;
      for (const VertexId v : t.v) box_.extend(vertices[v].head<2>());
    }
    if (box_.isEmpty()) return;
    first_ = index_above(box_.min());
    const Eigen::Vector2i last = index_above(box_.max());
    across_ = std::max(0, last.x() - first_.x());
    crossings_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(std::max(0, last.y() - first_.y())));
    for (const Triangle& t : triangles)
      if (t.alive()) add(t);
  }

  // Calls visit(midpoint, length) for pieces that cover these intervals: of one region each, or of at most a step.
  template <class Visit>
  void pieces(const Regions& regions, const Visit& visit) {
    for (std::size_t c = 0; c < crossings_.size(); ++c) {
      std::ranges::sort(crossings_[c]);
      int depth = 0;
      for (std::size_t k = 0; k + 1 < crossings_[c].size(); ++k) {
        depth += crossings_[c][k].second;
        if (depth > 0) pieces_between(regions, at(c), crossings_[c][k].first, crossings_[c][k + 1].first, visit);
      }
    }
  }

 private:
  // Offsets the lines by an odd share of a step, so that a vertex is unlikely to lie on one.
  static constexpr double kOffset = 0.381966;

  Eigen::Vector2i index_above(const Eigen::Vector2d& p) const {
    return (p.array() / step_m_ - kOffset).ceil().cast<int>();
  }
  Eigen::Vector2d at(const Eigen::Vector2i& index) const { return step_m_ * (index.cast<double>().array() + kOffset); }
  Eigen::Vector2d at(std::size_t column) const {
    const int i = static_cast<int>(column);
    return at(Eigen::Vector2i(first_ + Eigen::Vector2i(i % across_, i / across_)));
  }

  // Twice the area of a, b, p seen from above, computed in the same way for both triangles at an edge, so that a line
  // passes through exactly one of them.
  double side(VertexId a, VertexId b, const Eigen::Vector2d& p) const {
    const bool turned = b < a;
    if (turned) std::swap(a, b);
    const Eigen::Vector2d u = vertices_[b].head<2>() - vertices_[a].head<2>(), w = p - vertices_[a].head<2>();
    const double area = u.x() * w.y() - u.y() * w.x();
    const double decided = area == 0 ? 1e-300 : area;
    return turned ? -decided : decided;
  }

  void add(const Triangle& t) {
    Eigen::AlignedBox2d box;
    for (const VertexId v : t.v) box.extend(vertices_[v].head<2>());
    const Eigen::Vector2i low = index_above(box.min()), high = index_above(box.max());
    for (int j = low.y(); j < high.y(); ++j)
      for (int i = low.x(); i < high.x(); ++i) {
        const Eigen::Vector2d p = at(Eigen::Vector2i(i, j));
        const double a = side(t.v[1], t.v[2], p), b = side(t.v[2], t.v[0], p), c = side(t.v[0], t.v[1], p);
        if (!((a > 0) == (b > 0) && (b > 0) == (c > 0))) continue;
        const double z =
            (a * vertices_[t.v[0]].z() + b * vertices_[t.v[1]].z() + c * vertices_[t.v[2]].z()) / (a + b + c);
        const auto column = static_cast<std::size_t>((j - first_.y()) * across_ + i - first_.x());
        crossings_[column].emplace_back(z, a > 0 ? -1 : 1);  // a line that goes up enters where the surface faces down
      }
  }

  template <class Visit>
  void pieces_between(const Regions& regions, const Eigen::Vector2d& p, double low, double high,
                      const Visit& visit) const {
    const Vec3 middle(p.x(), p.y(), 0.5 * (low + high));
    const double first = std::floor(low / step_m_ + 1e-9) + 1, last = std::ceil(high / step_m_ - 1e-9) - 1;
    if (first > last || is_one_region(regions, middle, 0.5 * (high - low))) {
      if (high > low) visit(middle, high - low);
      return;
    }
    // At multiples of a step, wherever the interval ends: tissue that is cut off above moves no border beneath.
    const double cut_m = step_m_ * std::clamp(std::round(middle.z() / step_m_), first, last);
    pieces_between(regions, p, low, cut_m, visit);
    pieces_between(regions, p, cut_m, high, visit);
  }

  std::span<const Vec3> vertices_;
  double step_m_;
  Eigen::AlignedBox2d box_;
  Eigen::Vector2i first_ = Eigen::Vector2i::Zero();
  int across_ = 0;
  std::vector<std::vector<std::pair<double, int>>> crossings_;  // height, and the change of the winding number
};

}  // namespace

double RegionVolumes::marked_m3(const Regions& regions) const {
  double sum = 0;
  for (std::size_t i = 0; i < regions.size(); ++i)
    if (regions[i].marked) sum += region_m3[i];
  return sum;
}

double RegionVolumes::total_m3() const {
  return std::accumulate(region_m3.begin(), region_m3.end(), other_m3);
}

RegionVolumes region_volumes(const Regions& regions, std::span<const Vec3> vertices,
                             std::span<const Tetrahedron> tetrahedra, double resolution_m) {
  RegionVolumes volumes = none_of(regions);
  for (const Tetrahedron& t : tetrahedra)
    add_tetrahedron(regions, {vertices[t[0]], vertices[t[1]], vertices[t[2]], vertices[t[3]]}, resolution_m, volumes);
  return volumes;
}

RegionVolumes region_volumes(const Regions& regions, std::span<const Vec3> vertices,
                             std::span<const Triangle> triangles, double resolution_m) {
  RegionVolumes volumes = none_of(regions);
  if (regions.empty()) {
    volumes.other_m3 = std::max(0.0, enclosed_m3(vertices, triangles));  // the wall of a cavity encloses no tissue
    return volumes;
  }
  Columns columns(vertices, triangles, resolution_m);
  columns.pieces(regions, [&](const Vec3& middle, double length_m) {
    add(volumes, region_at(regions, middle), length_m * resolution_m * resolution_m);
  });
  return volumes;
}

std::vector<std::uint32_t> regions_at(const Regions& regions, std::span<const Vec3> rest_m) {
  std::vector<std::uint32_t> result;
  result.reserve(rest_m.size());
  for (const Vec3& x : rest_m) result.push_back(region_at(regions, x));
  return result;
}

std::vector<std::uint32_t> regions_of(const Regions& regions, const TetMesh& mesh) {
  std::vector<std::uint32_t> result;
  result.reserve(mesh.tetrahedra.size());
  const auto& x = mesh.vertices_body_m;
  for (const Tetrahedron& t : mesh.tetrahedra)
    result.push_back(region_at(regions, (x[t[0]] + x[t[1]] + x[t[2]] + x[t[3]]) / 4));
  return result;
}

}  // namespace sectio
