#include "sim_server/body_contact/walls_at_rest.h"

#include <algorithm>
#include <cmath>

#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr double kCube = 2;       // reaches
constexpr double kLookAgain = 8;  // reaches: a wall with a corner this far away may have left

}  // namespace

bool is_wall(const TriangleMesh& mesh, TriangleId t) {
  return t < mesh.triangle_slots() && mesh.triangle(t).alive() && mesh.triangle(t).surface == Surface::wall;
}

WallsAtRest::Key WallsAtRest::key(const Vec3& x) const {
  const Vec3 scaled = x / (kCube * reach_m_);
  return {static_cast<int>(std::floor(scaled.x())), static_cast<int>(std::floor(scaled.y())),
          static_cast<int>(std::floor(scaled.z()))};
}

WallsAtRest::Cubes WallsAtRest::cubes_of(const TriangleMesh& mesh, TriangleId t) const {
  Box3 box;
  for (const VertexId v : mesh.triangle(t).v) box.extend(mesh.rest_body_m(v));
  return {key(box.min()), key(box.max())};
}

void WallsAtRest::add(const TriangleMesh& mesh, TriangleId t) {
  const auto [low, high] = cubes_of(mesh, t);
  for (int i = low[0]; i <= high[0]; ++i)
    for (int j = low[1]; j <= high[1]; ++j)
      for (int k = low[2]; k <= high[2]; ++k) {
        std::vector<TriangleId>& cube = cubes_[{i, j, k}];
        if (std::ranges::find(cube, t) == cube.end()) cube.push_back(t);
      }
}

bool WallsAtRest::has_left(const TriangleMesh& mesh, TriangleId t, const Vec3& near_body_m, const Key& cube) const {
  if (!is_wall(mesh, t)) return true;
  const double far_m = kLookAgain * reach_m_;
  if ((mesh.rest_body_m(mesh.triangle(t).v[0]) - near_body_m).squaredNorm() < far_m * far_m) return false;
  const auto [low, high] = cubes_of(mesh, t);
  for (std::size_t i = 0; i < 3; ++i)
    if (cube[i] < low[i] || cube[i] > high[i]) return true;
  return false;
}

}  // namespace sectio
