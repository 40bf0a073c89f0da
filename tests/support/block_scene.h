// A block, 60 x 60 x 40 mm, on a floor, whose middle is at x = y = 0: what tests of models begin with.
#pragma once

#include "sim_server/scene/scene.h"
#include "tests/support/shapes.h"

namespace sectio::test {

inline Scene block_scene(const std::string& model) {
  Scene scene;
  scene.floor_z_m = 0;
  scene.bodies.emplace_back();
  BodySpec& body = scene.bodies[0];
  body.name = "block";
  body.model = model;
  body.mesh = box(6, 6, 4, Vec3(0.06, 0.06, 0.04));
  body.pose.position_m = Vec3(-0.03, -0.03, 0);
  body.volume.tetrahedra = 800;
  return scene;
}

}  // namespace sectio::test
