// Regions of a body, through the whole simulation: a lump inside is felt from outside.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sim_server/prepare/prepare.h"
#include "sim_server/session/offline_run.h"
#include "sim_server/simulation.h"
#include "tests/support/block_scene.h"

namespace sectio::simulation_test {
namespace {

Scene block_under_probe(const std::string& model) {
  Scene scene = test::block_scene(model);
  BodySpec& body = scene.bodies[0];
  body.material.foundation_radius_m = 0.03;  // the foundation looks this deep
  body.volume.cell_m = 0.006;
  body.cutting.threshold_force_n = 1e9;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.001)};
  scene.tools.emplace_back();
  scene.tools[0].name = "probe";
  scene.tools[0].kind = "probe";
  scene.tools[0].geometry = instrument_of("probe").geometry;
  return scene;
}

Regions lump(double stiffness_factor) {
  Region region;
  region.name = "lump";
  region.stiffness_factor = stiffness_factor;
  region.parts = {{RegionForm::ellipsoid, Vec3(0.03, 0.03, 0.02), Vec3(0.018, 0.018, 0.014)}};
  return {region};
}

double felt_n(const Scene& scene) {
  Simulation simulation(prepared(scene));
  StepInput input;
  double force_n = 0;
  for (std::uint64_t n = 1; n <= 600; ++n) {
    const double depth = std::max(0.0, std::min(1.0, (static_cast<double>(n) - 200) / 300)) * 0.014;
    input.samples = {{0, n, 0.001 * static_cast<double>(n), Pose{Vec3(0.001, 0.002, 0.05 - depth)}, 0}};
    for (const ContactModel& c : simulation.step(input).contacts) force_n = c.force_world_n.norm();
  }
  return force_n;
}

class RegionsOf : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, RegionsOf,
                         testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(RegionsOf, a_stiff_one_is_felt_through_the_tissue_and_one_that_is_alike_is_not) {
  Scene scene = block_under_probe(GetParam());
  const double plain = felt_n(scene);
  scene.bodies[0].regions = lump(1);
  EXPECT_EQ(felt_n(scene), plain);
  scene.bodies[0].regions = lump(8);
  const double lumpy = felt_n(scene);
  EXPECT_GT(lumpy, 1.2 * plain);
  EXPECT_LT(lumpy, 8 * plain);
}

TEST_P(RegionsOf, the_report_says_how_much_there_is_of_each) {
  Scene scene = block_under_probe(GetParam());
  scene.bodies[0].regions = lump(1);
  scene.bodies[0].regions[0].marked = true;
  const auto report = nlohmann::json::parse(run_offline(prepared(scene), 2, "").report);
  const double ball_m3 = 4 * M_PI / 3 * 0.018 * 0.018 * 0.014;
  EXPECT_NEAR(report["bodies"][0]["region_volumes_m3"]["lump"].get<double>(), ball_m3, 0.01 * ball_m3);
  EXPECT_EQ(report["bodies"][0]["marked_volume_m3"], report["bodies"][0]["region_volumes_m3"]["lump"]);
}

}  // namespace
}  // namespace sectio::simulation_test
