// A block that is held from below, without weight, under a probe with a ball at its tip.
#pragma once

#include <array>
#include <string>

#include "sim_server/scene/scene.h"

namespace sectio::test {

struct BallOnBlock {
  std::string model;
  Vec3 size_m;                 // size of the block, whose top is at size_m.z(), its middle at x = y = 0
  std::array<int, 3> squares;  // on its surface, along each side
  double young_pa, poisson;
  double radius_m, depth_m;  // radius of the ball; the foundation is made for this depth
  double step_s = 0.001;
  double tetrahedra = 0, cell_m = 0;  // tetrahedra of a volume, cell of a lattice
  std::string driver = "automatic";
};
Scene ball_on_block(const BallOnBlock& of);

}  // namespace sectio::test
