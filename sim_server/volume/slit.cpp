#include "sim_server/volume/slit.h"

#include <algorithm>
#include <cmath>

#include "common/core/sort_unique.h"

namespace sectio {

void Slit::add_vertices(std::span<const VertexId> vertices) {
  vertices_.insert(vertices_.end(), vertices.begin(), vertices.end());
  sort_unique(vertices_);
}

bool Slit::contains(const Vec3& at_m, double beside_m) const {
  return std::ranges::any_of(strips_, [&](const Strip& strip) {
    const std::array<Vec3, 4> corner{strip.from.tip_m, strip.from.heel_m, strip.to.heel_m, strip.to.tip_m};
    const Vec3 normal = (corner[2] - corner[0]).cross(corner[3] - corner[1]).stableNormalized();
    const Vec3 centre = 0.25 * (corner[0] + corner[1] + corner[2] + corner[3]);
    if (std::abs(normal.dot(at_m - centre)) > beside_m) return false;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 side = corner[(i + 1) % 4] - corner[i];
      if (side.cross(at_m - corner[i]).dot(normal) < 0) return false;
    }
    return true;
  });
}

}  // namespace sectio
