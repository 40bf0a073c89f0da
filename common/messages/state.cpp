#include "common/messages/state.h"

#include <algorithm>
#include <cmath>

namespace sectio {

Vec3f StatePiece::position_m(std::uint32_t i) const {
  Vec3f p;
  for (std::size_t k = 0; k < 3; ++k)
    p[static_cast<Eigen::Index>(k)] =
        static_cast<float>(quantum_m * (static_cast<double>(origin_quanta[k]) + offsets_quanta[3 * i + k]));
  return p;
}

bool to_grid(const Vec3f& position_m, GridPoint& point) {
  constexpr double kLimit_quanta = 1e9;
  GridPoint result;
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = std::nearbyint(static_cast<double>(position_m[static_cast<Eigen::Index>(k)]) / kQuantum_m);
    if (!(std::abs(x) <= kLimit_quanta)) return false;
    result[k] = static_cast<std::int32_t>(x);
  }
  point = result;
  return true;
}

void encode_positions(std::span<const GridPoint> points, StatePiece& piece) {
  GridPoint low = points.empty() ? GridPoint{} : points[0];
  GridPoint high = low;
  for (const GridPoint& p : points)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  int shift = 0;
  for (std::size_t k = 0; k < 3; ++k)
    while ((std::int64_t{high[k]} >> shift) - (std::int64_t{low[k]} >> shift) > 0xffff) ++shift;

  piece.quantum_m = std::ldexp(kQuantum_m, shift);
  for (std::size_t k = 0; k < 3; ++k) piece.origin_quanta[k] = low[k] >> shift;
  piece.offsets_quanta.clear();
  piece.offsets_quanta.reserve(points.size() * 3);
  for (const GridPoint& p : points)
    for (std::size_t k = 0; k < 3; ++k)
      piece.offsets_quanta.push_back(static_cast<std::uint16_t>((p[k] >> shift) - piece.origin_quanta[k]));
}

std::uint16_t to_level(float value, float least, float most) {
  const double share = (static_cast<double>(value) - least) / (static_cast<double>(most) - least);
  if (!(share > 0)) return 0;
  return static_cast<std::uint16_t>(std::nearbyint(std::min(share, 1.0) * kMostLevel));
}

float from_level(std::uint16_t level, float least, float most) {
  const double range = static_cast<double>(most) - least;
  return static_cast<float>(least + range * level / kMostLevel);
}

}  // namespace sectio
