#include "tests/support/block_scene.h"

#include "tests/support/shapes.h"

namespace sectio::test {

Scene block_scene(const std::string& model) {
  Scene scene;
  scene.floor_z_m = 0;
  scene.bodies.emplace_back();
  BodySpec& body = scene.bodies[0];
  body.name = "block";
  body.model = model;
  body.mesh = box(6, 6, 4, Vec3(0.06, 0.06, kBlockTop_m));
  body.pose.position_m = Vec3(-0.03, -0.03, 0);
  body.volume.tetrahedra = 800;
  return scene;
}

}  // namespace sectio::test
