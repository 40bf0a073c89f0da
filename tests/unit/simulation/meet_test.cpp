// Bodies that deform and touch each other, through the whole simulation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
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

constexpr double kTrayFloor_m = 0.004;
// A tray whose floor and walls are thin, so that what lies in it is in its box, held everywhere.
Scene tray() {
  Scene scene = plate_below("surface_springs", 0.02);
  BodySpec& body = scene.bodies[0];
  body.mesh = test::box(10, 10, 5, Vec3(0.064, 0.064, 0.02));
  for (Vec3& x : body.mesh.vertices_body_m)
    if (x.z() > 0.0199 && (x.head<2>() - Vec3(0.032, 0.032, 0).head<2>()).cwiseAbs().maxCoeff() < 0.026)
      x.z() = kTrayFloor_m;
  body.pose.position_m = Vec3(-0.032, -0.032, 0);
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  return scene;
}
BodySpec ball(const std::string& model, double radius_m, double young_pa, double above_m) {
  BodySpec body = cube(model, Vec3(0.001, 0.002, kTrayFloor_m + radius_m + above_m));
  body.name = "ball";
  body.mesh = test::ellipsoid(3, Vec3::Constant(radius_m));
  body.material.young_pa = young_pa;
  return body;
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

// Friction of 0.4 holds it on a slope of 15 degrees, but not on one of 30.
TEST_P(Stacked, one_sticks_to_the_slope_of_the_other_or_slides) {
  const auto& [below, above] = GetParam();
  const auto on_slope = [&, lower = below, upper = above](double slope_deg) {
    Scene scene = plate_below(lower, 0.02);
    const double slope = slope_deg * M_PI / 180;
    scene.gravity_m_per_s2 = 9.81 * Vec3(std::sin(slope), 0, -std::cos(slope));
    scene.sleep.after_s = 0.2;
    scene.bodies.push_back(cube(upper, Vec3(-0.02, -0.011, 0.0005)));
    auto simulation = std::make_unique<Simulation>(prepared(scene));
    for (int n = 0; n < 400; ++n) simulation->step({});
    return simulation;
  };
  const auto held = on_slope(15);
  const Vec3 begun_m = middle_m(*held, 1);
  for (int n = 0; n < 1000; ++n) held->step({});
  EXPECT_LT((middle_m(*held, 1) - begun_m).norm(), 1.5e-4);

  const auto slides = on_slope(30);
  const double at_m = middle_m(*slides, 1).x();
  for (int n = 0; n < 400; ++n) slides->step({});
  EXPECT_GT(middle_m(*slides, 1).x() - at_m, 5e-4);
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

TEST_P(Alone, a_ball_lies_on_a_thin_tray) {
  struct Case {
    double radius_m, young_pa, above_m;
  };
  for (const auto& [radius_m, young_pa, above_m] :
       {Case{0.014, 5000, 1e-4}, Case{0.012, 3000, 0.02}, Case{0.007, 100000, 1e-4}}) {
    Scene scene = tray();
    scene.bodies.push_back(ball(GetParam(), radius_m, young_pa, above_m));
    Simulation simulation(prepared(scene));
    double deepest_m = 0;
    for (int n = 0; n < 600; ++n) {
      simulation.step({});
      deepest_m = std::max(deepest_m, kTrayFloor_m - lowest_m(simulation, 1));
    }
    EXPECT_LT(deepest_m, 0.001) << young_pa << " Pa, on its way";
    EXPECT_NEAR(lowest_m(simulation, 1), kTrayFloor_m, 0.0004) << young_pa << " Pa";
    for (const BodyOverlap& o : simulation.overlaps()) {
      EXPECT_LT(o.deepest_m, 0.0004);
      EXPECT_EQ(o.come_through, 0u);
    }
  }
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
