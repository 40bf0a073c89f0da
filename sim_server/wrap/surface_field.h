// Distance and winding number of a soup of triangles that may be open, doubled or cross itself.
#pragma once

#include <span>
#include <vector>

#include "common/math/intersect.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

class SurfaceField {
 public:
  explicit SurfaceField(const TriangleSoup& soup);

  // The closest point of the surface. O(log n).
  Vec3 closest(const Vec3& p) const;
  double distance(const Vec3& p) const { return (closest(p) - p).norm(); }
  // How often the surface winds around p (Jacobson 2013): 1 inside a closed surface, 0 outside, about the share of the
  // view that is closed where there are holes. Triangles that are far away count as dipoles (Barill 2018). O(log n).
  double winding(const Vec3& p) const { return winding(0, p); }

 private:
  struct Node {
    Box3 box;
    Vec3 centre = Vec3::Zero(), area_vector = Vec3::Zero();
    double radius = 0;
    std::uint32_t first = 0, count = 0;  // triangles; inner nodes have none
    std::uint32_t left = 0, right = 0;
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count);
  double winding(std::uint32_t node, const Vec3& p) const;
  void closest(std::uint32_t node, const Vec3& p, double& best2, Vec3& at) const;

  std::vector<std::array<Vec3, 3>> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace sectio
