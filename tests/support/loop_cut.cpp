#include "tests/support/loop_cut.h"

#include <cmath>

namespace sectio::test {

Scene loop_scene(FreeParts free_parts) {
  Scene scene = organ_scene();
  scene.bodies[0].mesh = ellipsoid(4, Vec3(0.06, 0.06, kOrganTop_m));
  scene.bodies[0].splitting.free_parts = free_parts;
  scene.tools.push_back(scene.tools[0]);
  scene.tools[1].name = "other";
  return scene;
}

Pose loop_pose(double deg, double depth_m) {
  const double a = deg * M_PI / 180, x = kLoopRadius_m * std::cos(a), y = kLoopRadius_m * std::sin(a);
  return {Vec3(x, y, organ_height_m(x, y) - depth_m),
          Eigen::Quaterniond(Eigen::AngleAxisd(a + M_PI / 2, Vec3::UnitZ()))};
}

void cut_on(Operation& op, double from_deg, double to_deg) {
  for (double deg = from_deg; deg <= to_deg; deg += 0.15) op.step({{0, loop_pose(deg, kLoopDepth_m)}});
}

void cut_arc(Operation& op, double from_deg, double to_deg) {
  for (double above_m = 0.01; above_m > -kLoopDepth_m; above_m -= 1e-4) op.step({{0, loop_pose(from_deg, -above_m)}});
  cut_on(op, from_deg, to_deg);
}

void lift(Operation& op) {
  op.move(op.hand().position_m + Vec3(0, 0, 0.03), 0.1);
}

}  // namespace sectio::test
