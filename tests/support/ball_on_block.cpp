#include "tests/support/ball_on_block.h"

#include <cmath>

#include "tests/support/gripper.h"

namespace sectio::test {

Scene ball_on_block(const BallOnBlock& of) {
  Scene scene;
  scene.file = "block";
  scene.step_s = of.step_s;
  scene.gravity_m_per_s2.setZero();
  BodySpec block;
  block.name = "block";
  block.model = of.model;
  block.mesh = box(of.squares[0], of.squares[1], of.squares[2], of.size_m);
  block.pose.position_m = Vec3(-of.size_m.x() / 2, -of.size_m.y() / 2, 0);
  block.material.young_pa = of.young_pa;
  block.material.poisson = of.poisson;
  block.material.foundation_radius_m = std::sqrt(of.radius_m * of.depth_m);  // the contact's radius
  block.volume.tetrahedra = of.tetrahedra;
  block.volume.cell_m = of.cell_m;
  block.volume.driver = of.driver;
  block.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1e-6)};
  scene.bodies.push_back(block);
  scene.tools.push_back(tool_of("ball", "probe"));
  scene.tools[0].geometry.sphere_radius_m = of.radius_m;
  return scene;
}

}  // namespace sectio::test
