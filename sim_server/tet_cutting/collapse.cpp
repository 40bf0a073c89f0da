#include "sim_server/tet_cutting/collapse.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

bool has(const Tetrahedron& t, VertexId v) {
  return std::ranges::find(t, v) != t.end();
}

bool is_inside(const TetTopology& volume, VertexId v) {
  for (const std::uint32_t t : volume.star(v))
    for (std::size_t corner = 0; corner < 4; ++corner)
      if (volume.tetrahedra()[t][corner] != v && volume.across(t, corner) == kNone) return false;
  return volume.alive(v);
}

// Beside the mean over all edges of its tetrahedra, at rest.
bool is_short(const TetTopology& volume, VertexId v, VertexId w, double ratio) {
  double sum_m = 0;
  std::size_t edges = 0;
  for (const std::uint32_t t : volume.star(v)) {
    const Tetrahedron& c = volume.tetrahedra()[t];
    if (!has(c, w)) continue;
    for (const auto& [i, j] : kTetEdges)
      sum_m += (volume.vertex(c[i]).rest_body_m - volume.vertex(c[j]).rest_body_m).norm();
    edges += kTetEdges.size();
  }
  const double length_m = (volume.vertex(v).rest_body_m - volume.vertex(w).rest_body_m).norm();
  return length_m * static_cast<double>(edges) < ratio * sum_m;
}

double world_volume_m3(const TetTopology& volume, const Tetrahedron& c) {
  const auto at = [&](std::size_t k) -> const Vec3& { return volume.vertex(c[k]).position_world_m; };
  return tet_volume_m3(at(0), at(1), at(2), at(3));
}

double quality(const TetTopology& volume, const Tetrahedron& c) {
  const auto at = [&](std::size_t k) -> const Vec3& { return volume.vertex(c[k]).rest_body_m; };
  return shape_quality(at(0), at(1), at(2), at(3));
}

bool gets_no_worse(const TetTopology& volume, VertexId v, VertexId w) {
  double worst = 1;
  for (const std::uint32_t t : volume.star(v)) worst = std::min(worst, quality(volume, volume.tetrahedra()[t]));
  return std::ranges::all_of(volume.star(v), [&](std::uint32_t t) {
    Tetrahedron moved = volume.tetrahedra()[t];
    if (has(moved, w)) return true;
    *std::ranges::find(moved, v) = w;
    return quality(volume, moved) >= std::max(worst, 1e-9) && world_volume_m3(volume, moved) > 0;
  });
}

}  // namespace

double shape_quality(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double squares = (a - b).squaredNorm() + (a - c).squaredNorm() + (a - d).squaredNorm() + (b - c).squaredNorm() +
                         (b - d).squaredNorm() + (c - d).squaredNorm();
  return 6 * std::sqrt(2.0) * tet_volume_m3(a, b, c, d) / std::pow(squares / 6, 1.5);
}

double shape_quality(const TetTopology& volume, std::uint32_t t) {
  return quality(volume, volume.tetrahedra()[t]);
}

std::optional<VertexId> collapse_onto(const TetTopology& volume, VertexId v, double ratio) {
  std::vector<std::pair<double, VertexId>> ends;
  for (const std::uint32_t t : volume.star(v))
    for (const VertexId w : volume.tetrahedra()[t])
      if (w != v) ends.emplace_back((volume.vertex(v).rest_body_m - volume.vertex(w).rest_body_m).squaredNorm(), w);
  std::ranges::sort(ends);
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::erase_if(ends, [&](const auto& end) { return !is_short(volume, v, end.second, ratio); });
  if (ends.empty() || !is_inside(volume, v)) return {};
  for (const auto& [length2, w] : ends)
    if (gets_no_worse(volume, v, w)) return w;
  return {};
}

}  // namespace sectio
