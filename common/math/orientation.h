// Exact orientation of four points: a filtered determinant which falls back on expansion arithmetic (Shewchuk 1997), so
// that the sign is never wrong. Pure functions.
#pragma once

#include "common/math/types.h"

namespace sectio {

struct Orientation {
  double value = 0;  // det[b - a, c - a, d - a], rounded: six times the signed volume
  int sign = 0;      // sign of the exact determinant: -1, 0 or 1
};

// Positive when d is on the side to which the normal (b - a) x (c - a) points.
Orientation orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Exact sign of the first component of (a1 - a0) x (b1 - b0) that is not zero; 0 when the two are parallel.
int leading_sign_of_cross(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1);

}  // namespace sectio
