// The region of a sweep inside a body: polygons with the surface's paths above and the trail of the tip below (paper A,
// 2.3). Pure functions.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/surface/cutting/sweep_path.h"

namespace sectio {

// A corner of such a polygon, before it has vertices.
struct RimItem {
  enum class What : std::uint8_t { path, tip_first, tip_last, bottom };
  What what = What::path;
  std::size_t path = 0, point = 0;  // the point of a path, or the one above a bottom
  Vec2 at = Vec2::Zero();
  double rim_position = 0;
};
using Rim = std::vector<RimItem>;  // clockwise

// Joins paths to polygons: clockwise along the rim of the sweep, the beginning of a path follows each end of one.
// Nothing when beginnings and ends don't alternate, as when a path goes round a hole or the surface crosses itself.
std::optional<std::vector<Rim>> join_paths(std::span<const SurfacePath> paths, const BladeSweep& sweep);

}  // namespace sectio
