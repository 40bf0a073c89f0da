// The orthonormal frame of a triangle.
#pragma once

#include "common/math/types.h"

namespace sectio {

// Columns: along ab, across it in the triangle's plane, along the normal. Zero columns where the triangle has none.
inline Mat3 frame_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 along = (b - a).stableNormalized();
  const Vec3 normal = (b - a).cross(c - a).stableNormalized();
  Mat3 frame;
  frame << along, normal.cross(along), normal;
  return frame;
}

}  // namespace sectio
