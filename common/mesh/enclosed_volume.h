// The volume that closed triangles enclose, positive when they face outward: the sum over the tetrahedra between each
// triangle and the first corner, near which less is cancelled than about the origin.
#pragma once

#include <optional>

#include "common/math/types.h"

namespace sectio {

class EnclosedVolume {
 public:
  void add(const Vec3& a_m, const Vec3& b_m, const Vec3& c_m) {
    if (!near_m_) near_m_ = a_m;
    six_m3_ += (a_m - *near_m_).dot((b_m - *near_m_).cross(c_m - *near_m_));
  }
  double m3() const { return six_m3_ / 6; }

 private:
  std::optional<Vec3> near_m_;
  double six_m3_ = 0;
};

}  // namespace sectio
