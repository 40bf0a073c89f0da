// Bodies that deform and touch each other, through the whole simulation.
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/support/block_scene.h"
#include "tests/support/shapes.h"

namespace sectio::simulation_test {
namespace {

BodySpec cube(const std::string& model, const Vec3& at_world_m) {
  BodySpec body = test::block_scene(model).bodies[0];
  body.name = "cube";
  body.mesh = test::box(6, 6, 3, Vec3(0.02, 0.02, 0.01));
  body.pose.position_m = at_world_m;
  body.volume.tetrahedra = 500;
  body.volume.cell_m = 0;  // the default's don't divide the body beneath
  body.fixed.reset();
  return body;
}
Scene plate_below(const std::string& model, double thick_m) {
  Scene scene = test::block_scene(model);
  scene.floor_z_m = -0.1;
  scene.sleep.after_s = 0;
  BodySpec& body = scene.bodies[0];
  body.mesh = test::box(10, 10, 3, Vec3(0.06, 0.06, thick_m));
  body.pose.position_m = Vec3(-0.03, -0.03, -thick_m);
  body.volume.cell_m = 0;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -thick_m + 2e-4)};
  return scene;
}

double lowest_m(const Simulation& simulation, std::uint32_t body) {
  double z = 1;
  for (const Vec3f x : simulation.positions_world_m(body)) z = std::min(z, double{x.z()});
  return z;
}
Vec3 middle_m(const Simulation& simulation, std::uint32_t body) {
  Vec3 sum = Vec3::Zero();
  std::size_t count = 0;
  for (const Vec3f x : simulation.positions_world_m(body)) sum += x.cast<double>(), ++count;
  return sum / static_cast<double>(count);
}

using Models = std::tuple<std::string, std::string>;
class Stacked : public testing::TestWithParam<Models> {};
const auto kModels = testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice");
INSTANTIATE_TEST_SUITE_P(All, Stacked, testing::Combine(kModels, kModels));

TEST_P(Stacked, one_lies_on_the_other_and_comes_to_rest) {
  const auto& [below, above] = GetParam();
  Scene scene = plate_below(below, 0.02);
  scene.bodies.push_back(cube(above, Vec3(-0.008, -0.011, 0.003)));
  Simulation simulation(prepared(scene));
  for (int n = 0; n < 399; ++n) simulation.step({});
  EXPECT_EQ(simulation.step({}).report.instrument_work_j, 0);
  EXPECT_GT(lowest_m(simulation, 1), -0.0025);
  EXPECT_LT(lowest_m(simulation, 1), 0.0005);
}

class Alone : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Alone, kModels);

TEST_P(Alone, it_lies_on_a_thin_tray) {
  Scene scene = plate_below("surface_springs", 0.003);
  scene.bodies[0].fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  scene.bodies.push_back(cube(GetParam(), Vec3(-0.008, -0.011, 0.003)));
  Simulation simulation(prepared(scene));
  for (int n = 0; n < 500; ++n) simulation.step({});
  EXPECT_NEAR(lowest_m(simulation, 1), 0, 0.001);
}

class Parting : public testing::TestWithParam<Models> {};  // homes would hold a skin
const auto kVolumes = testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice");
INSTANTIATE_TEST_SUITE_P(All, Parting, testing::Combine(kVolumes, kVolumes));

TEST_P(Parting, bodies_that_push_each_other_apart_keep_their_momentum) {
  const auto& [below, above] = GetParam();
  Scene scene = test::block_scene(below);
  scene.floor_z_m.reset();
  scene.gravity_m_per_s2.setZero();
  scene.bodies = {cube(below, Vec3::Zero()), cube(above, Vec3(0.003, 0.002, 0.0095))};
  Simulation simulation(prepared(scene));
  const Vec3 from[] = {middle_m(simulation, 0), middle_m(simulation, 1)};
  for (int n = 0; n < 300; ++n) simulation.step({});
  const Vec3 way[] = {middle_m(simulation, 0) - from[0], middle_m(simulation, 1) - from[1]};
  EXPECT_GT(way[1].z() - way[0].z(), 0.0005) << "they part";
  EXPECT_LT((way[0] + way[1]).norm(), 0.05 * (way[1] - way[0]).norm());
}

// A soft block that is held above hangs down by some millimetres.
BodySpec hanging(const std::string& model, double lower_end_m) {
  BodySpec body = cube(model, Vec3(-0.008, -0.011, lower_end_m));
  body.mesh = test::box(6, 6, 6, Vec3(0.02, 0.02, 0.03));
  body.material.young_pa = 1000;
  body.fixed = Box{Vec3(-1, -1, lower_end_m + 0.03 - 2e-4), Vec3(1, 1, 1)};
  return body;
}

class Held : public testing::TestWithParam<Models> {};
INSTANTIATE_TEST_SUITE_P(All, Held,
                         testing::Values(Models("tetra_springs", "neo_hookean"),
                                         Models("neo_hookean", "neo_hookean_lattice"),
                                         Models("neo_hookean_lattice", "tetra_springs")));

TEST_P(Held, organs_touch_each_other) {
  const auto& [below, above] = GetParam();
  Scene scene = plate_below(below, 0.02);
  scene.bodies.push_back(hanging(above, 0.001));
  Scene alone = scene;
  alone.bodies.erase(alone.bodies.begin());
  Simulation simulation(prepared(scene)), hangs(prepared(alone));
  for (int n = 0; n < 400; ++n) simulation.step({}), hangs.step({});
  EXPECT_LT(lowest_m(hangs, 0), -0.002);
  EXPECT_GT(lowest_m(simulation, 1), -0.001);
}

TEST_P(Held, organs_that_are_placed_within_each_other_do_not_push_each_other_apart) {
  const auto& [below, above] = GetParam();
  Scene scene = plate_below(below, 0.02);
  scene.gravity_m_per_s2.setZero();
  scene.bodies.push_back(hanging(above, -0.003));
  Simulation simulation(prepared(scene));
  for (int n = 0; n < 100; ++n) simulation.step({});
  EXPECT_NEAR(lowest_m(simulation, 1), -0.003, 1e-5);
}

}  // namespace
}  // namespace sectio::simulation_test
