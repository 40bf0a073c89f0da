#include "sim_server/surface/cutting/sweep_rim.h"

namespace sectio {
namespace {

// In a clockwise rim the body is on the right.
bool is_clockwise(const Rim& rim) {
  double twice_area = 0;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Vec2 &a = rim[i].at, &b = rim[(i + 1) % rim.size()].at;
    twice_area += a.x() * b.y() - a.y() * b.x();
  }
  return twice_area < 0;
}

std::size_t path_begun_below(std::span<const SurfacePath> paths, double rim_position) {
  std::size_t best = paths.size();
  for (std::size_t p = 0; p < paths.size(); ++p) {
    if (paths[p].closed || paths[p].points.front().rim_position >= rim_position) continue;
    if (best == paths.size() || paths[p].points.front().rim_position > paths[best].points.front().rim_position)
      best = p;
  }
  return best;
}

}  // namespace

std::optional<std::vector<Rim>> join_paths(std::span<const SurfacePath> paths, const BladeSweep& sweep) {
  std::vector<Rim> rims;
  std::vector<bool> used(paths.size(), false);
  for (std::size_t first = 0; first < paths.size(); ++first) {
    if (used[first]) continue;
    Rim rim;
    std::size_t p = first;
    do {
      if (used[p]) return std::nullopt;
      used[p] = true;
      for (std::size_t i = 0; i < paths[p].points.size(); ++i)
        rim.push_back({RimItem::What::path, p, i, paths[p].points[i].at, paths[p].points[i].rim_position});
      if (paths[p].closed) break;
      const double end = paths[p].points.back().rim_position;
      const std::size_t next = path_begun_below(paths, end);
      if (next == paths.size()) return std::nullopt;
      const double begin = paths[next].points.front().rim_position;
      if (begin < 2 && end > 2) rim.push_back({RimItem::What::tip_last, 0, 0, sweep.tip_last(), 2});
      if (begin < 1 && end > 1) rim.push_back({RimItem::What::tip_first, 0, 0, sweep.tip_first(), 1});
      p = next;
    } while (p != first);
    if (!is_clockwise(rim)) return std::nullopt;
    rims.push_back(std::move(rim));
  }
  return rims;
}

}  // namespace sectio
