// The walls of cuts by their places at rest: a grid of cubes with the triangles whose boxes reach into each. A cut that
// undermines tissue leaves walls that meet nowhere near, though they touched before it.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

class WallsAtRest {
 public:
  explicit WallsAtRest(double cube_m) : cube_m_(cube_m) {}

  // Takes the walls around a vertex. Triangles that are gone, or elsewhere, are dropped when a search meets them.
  void add_around(const TriangleMesh& mesh, VertexId v);

  // Calls with walls, each at least once, that may lie within a cube's size of a place. O(walls there).
  template <class Call>
  void near(const TriangleMesh& mesh, const Vec3& at_body_m, const Call& call) {
    const Key middle = key(at_body_m);
    for (int i = middle[0] - 1; i <= middle[0] + 1; ++i)
      for (int j = middle[1] - 1; j <= middle[1] + 1; ++j)
        for (int k = middle[2] - 1; k <= middle[2] + 1; ++k) {
          const auto cube = cubes_.find({i, j, k});
          if (cube == cubes_.end()) continue;
          std::erase_if(cube->second, [&](TriangleId t) { return !reaches_into(mesh, t, cube->first); });
          for (const TriangleId t : cube->second) call(t);
          if (cube->second.empty()) cubes_.erase(cube);
        }
  }

  template <class A>
  void archive(A& a) {
    a(cubes_);
  }

 private:
  using Key = std::array<int, 3>;
  Key key(const Vec3& x) const {
    const Vec3 scaled = x / cube_m_;
    return {static_cast<int>(std::floor(scaled.x())), static_cast<int>(std::floor(scaled.y())),
            static_cast<int>(std::floor(scaled.z()))};
  }
  bool reaches_into(const TriangleMesh& mesh, TriangleId t, const Key& cube) const;

  double cube_m_;
  std::map<Key, std::vector<TriangleId>> cubes_;
};

// A live triangle of a wall.
bool is_wall(const TriangleMesh& mesh, TriangleId t);

}  // namespace sectio
