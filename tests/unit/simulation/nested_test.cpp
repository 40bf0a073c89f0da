// Organs that the scene places within each other, each held at a place of its own.
#include <gtest/gtest.h>

#include <utility>

#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/support/block_scene.h"
#include "tests/support/shapes.h"

namespace sectio::simulation_test {
namespace {

constexpr double kOrgan_m = 0.03, kTumour_m = 0.008;

BodySpec held_ball(const std::string& name, double radius_m, double z_m, double held_below_m) {
  BodySpec body = test::block_scene("surface_springs").bodies[0];
  body.name = name;
  body.mesh = test::ellipsoid(3, Vec3::Constant(radius_m));
  body.pose.position_m = Vec3(0, 0, z_m);
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, held_below_m)};
  return body;
}

TEST(Nested, a_body_wholly_inside_another_is_grown_together_with_it_however_deep_it_lies) {
  for (const double deep_m : {0.001, 0.003, 0.006, 0.009, 0.013, 0.018}) {
    Scene scene = test::block_scene("surface_springs");
    scene.floor_z_m = -0.1;
    scene.bodies = {held_ball("organ", kOrgan_m, 0, -0.01),
                    held_ball("tumour", kTumour_m, kOrgan_m - kTumour_m - deep_m, 1)};
    scene = prepared(std::move(scene));
    Simulation simulation(scene);
    for (int i = 0; i < 20; ++i) simulation.step({});
    EXPECT_TRUE(simulation.overlaps().empty()) << deep_m;
  }
}

}  // namespace
}  // namespace sectio::simulation_test
