// Inside or outside of a surface by the share of the sphere that its triangles cover (van Oosterom and Strackee 1983).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "common/math/types.h"

namespace sectio {

// The share of the sphere around p that the triangle x y z covers, positive when p sees its back. All triangles of a
// closed surface that faces outwards: 1 inside, 0 outside.
inline double share_seen_from(const Vec3& p, const Vec3& x_m, const Vec3& y_m, const Vec3& z_m) {
  const Vec3 x = x_m - p, y = y_m - p, z = z_m - p;
  const double lx = x.norm(), ly = y.norm(), lz = z.norm();
  return std::atan2(x.dot(y.cross(z)), lx * ly * lz + x.dot(y) * lz + y.dot(z) * lx + z.dot(x) * ly) / (2 * M_PI);
}

// Whether p is inside a closed surface; on the surface it is not.
inline bool is_inside(const Vec3& p, std::span<const Vec3> vertices,
                      std::span<const std::array<std::uint32_t, 3>> triangles) {
  double share = 0;
  for (const auto& [a, b, c] : triangles) share += share_seen_from(p, vertices[a], vertices[b], vertices[c]);
  return std::abs(share) > 0.9;
}

}  // namespace sectio
