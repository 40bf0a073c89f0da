// The walls of cuts by their places at rest: a grid of cubes with the triangles whose boxes reach into each. A cut that
// undermines tissue leaves walls that meet nowhere near, though they touched before it.
#pragma once

#include <array>
#include <map>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

class WallsAtRest {
 public:
  explicit WallsAtRest(double reach_m) : reach_m_(reach_m) {}

  // Takes a wall. Triangles that are gone, or elsewhere now, are dropped when a search meets them.
  void add(const TriangleMesh& mesh, TriangleId t);

  // Calls with walls, each at least once: all that reach to within the grid's reach of a place, and others around.
  template <class Call>
  void near(const TriangleMesh& mesh, const Vec3& at_body_m, const Call& call) {
    const Key low = key(at_body_m.array() - reach_m_), high = key(at_body_m.array() + reach_m_);
    for (int i = low[0]; i <= high[0]; ++i)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int k = low[2]; k <= high[2]; ++k) {
          const auto cube = cubes_.find({i, j, k});
          if (cube == cubes_.end()) continue;
          std::erase_if(cube->second, [&](TriangleId t) { return has_left(mesh, t, at_body_m, cube->first); });
          for (const TriangleId t : cube->second) call(t);
        }
  }

  template <class A>
  void archive(A& a) {
    a(cubes_);
  }

 private:
  using Key = std::array<int, 3>;
  struct Cubes {
    Key low, high;  // ends included
  };
  Key key(const Vec3& x) const;
  Cubes cubes_of(const TriangleMesh& mesh, TriangleId t) const;
  bool has_left(const TriangleMesh& mesh, TriangleId t, const Vec3& near_body_m, const Key& cube) const;

  double reach_m_;
  std::map<Key, std::vector<TriangleId>> cubes_;
};

// A live triangle of a wall.
bool is_wall(const TriangleMesh& mesh, TriangleId t);

}  // namespace sectio
