// A grid of cubes with the triangles whose boxes meet each cube; finds the closest triangle near a point.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include "common/math/intersect.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

class NearTriangles {
 public:
  // `surface` must outlive this.
  NearTriangles(const TriangleSoup& surface, double size_m) : surface_(surface), size_m_(size_m) {
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      Box3 box;
      for (const VertexId v : surface.triangles[t]) box.extend(surface.vertices_body_m[v]);
      around_.push_back({box.center(), 0.5 * box.diagonal().norm()});
      const Key low = key(box.min()), high = key(box.max());
      for (int i = low[0]; i <= high[0]; ++i)
        for (int j = low[1]; j <= high[1]; ++j)
          for (int k = low[2]; k <= high[2]; ++k) cubes_[{i, j, k}].push_back(t);
    }
  }

  struct Found {
    Vec3 point;
    std::uint32_t triangle = kNone;
  };
  // The closest point of the triangles that count, if one lies within a cube's size of p; p itself if none is near.
  template <class Counts>
  Found closest(const Vec3& p, Counts counts) const {
    const Key at = key(p);
    Found found{p};
    double best = HUGE_VAL;
    for (int i = at[0] - 1; i <= at[0] + 1; ++i)
      for (int j = at[1] - 1; j <= at[1] + 1; ++j)
        for (int k = at[2] - 1; k <= at[2] + 1; ++k) {
          const auto cube = cubes_.find({i, j, k});
          if (cube == cubes_.end()) continue;
          for (const std::uint32_t t : cube->second) {
            if (!counts(t)) continue;
            const double reach = std::sqrt(best) + around_[t].radius_m;
            if ((p - around_[t].centre_m).squaredNorm() > (1 + kMargin) * reach * reach) continue;
            const auto& [a, b, c] = surface_.triangles[t];
            const auto& x = surface_.vertices_body_m;
            const ClosestPoint candidate = closest_on_triangle(p, {x[a], x[b], x[c]});
            if (!(candidate.squared_distance < best)) continue;
            best = candidate.squared_distance;
            found = {candidate.point, t};
          }
        }
    return found;
  }
  Vec3 closest(const Vec3& p) const {
    return closest(p, [](std::uint32_t) { return true; }).point;
  }

 private:
  using Key = std::array<int, 3>;
  Key key(const Vec3& p) const {
    const Vec3 scaled = p / size_m_;
    return {static_cast<int>(std::floor(scaled.x())), static_cast<int>(std::floor(scaled.y())),
            static_cast<int>(std::floor(scaled.z()))};
  }
  struct Ball {
    Vec3 centre_m = Vec3::Zero();
    double radius_m = 0;
  };
  static constexpr double kMargin = 1e-9;  // for rounding

  const TriangleSoup& surface_;
  double size_m_;
  std::vector<Ball> around_;  // by triangle
  std::map<Key, std::vector<std::uint32_t>> cubes_;
};

}  // namespace sectio
