// Bodies that are volumes of tetrahedra, through the whole simulation.
#include "sim_server/prepare/prepare.h"
#include "sim_server/volume/volume_engines.h"

#include <gtest/gtest.h>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/simulation.h"
#include "tests/support/block_scene.h"
#include "tests/support/shapes.h"

namespace sectio::simulation_test {
namespace {

Scene block_on_table(const std::string& model) {
  Scene scene = test::block_scene(model);
  scene.bodies[0].pose.position_m.z() = 0.001;
  return scene;
}

double highest_m(const Simulation& simulation) {
  float top = -1;
  for (const Vec3f& x : simulation.positions_world_m(0)) top = std::max(top, x.z());
  return double{top};
}

class VolumeModels : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, VolumeModels, testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(VolumeModels, C_CON_1_fall_onto_the_floor_and_rest_there_whole) {
  Simulation simulation(prepared(block_on_table(GetParam())));
  for (int n = 0; n < 600; ++n) simulation.step({});
  float lowest = 1;
  for (const Vec3f& x : simulation.positions_world_m(0)) lowest = std::min(lowest, x.z());
  EXPECT_EQ(lowest, 0);
  EXPECT_GT(highest_m(simulation), 0.034);
  EXPECT_LT(highest_m(simulation), 0.0405);
  ASSERT_FALSE(simulation.body(0).mesh_notes.empty());
  EXPECT_NE(simulation.body(0).mesh_notes[0].find("stable step"), std::string::npos);
  EXPECT_EQ(simulation.body(0).mesh_notes.size(), GetParam() == "neo_hookean" ? 1u : 2u);
}

// The floor stops tissue that falls onto it within a long step. Tissue that falls through, and is put back after the
// step, is pressed together like a spring, and throws a body that lies.
TEST(LongSteps, a_tilted_body_that_falls_to_the_floor_lies_there) {
  for (const double tilt_rad : {0.3, 0.5, 0.75}) {
    Scene scene = block_on_table("neo_hookean");
    scene.step_s = 0.033;
    scene.bodies[0].volume.driver = "implicit";
    scene.bodies[0].pose = {Vec3(0, 0, 0.08),
                            Eigen::Quaterniond(Eigen::AngleAxisd(tilt_rad, Vec3(1, 2, 0).normalized()))};
    scene.bodies[0].mesh = test::box(6, 6, 6, Vec3::Constant(0.04));
    scene.bodies[0].material.young_pa = 20000;
    scene.bodies[0].volume.tetrahedra = 2000;
    scene.bodies[0].material.damping_per_s = 5;
    Simulation simulation(prepared(scene));
    double highest_gap_m = 0;
    std::uint64_t not_met = 0;
    for (int n = 0; n < 200; ++n) {
      not_met = simulation.step({}).report.drivers[0].steps_not_met;
      float lowest = 1;
      for (const Vec3f& x : simulation.positions_world_m(0)) lowest = std::min(lowest, x.z());
      if (n > 30) highest_gap_m = std::max(highest_gap_m, double{lowest});
    }
    EXPECT_LT(highest_gap_m, 0.002) << tilt_rad;
    EXPECT_LT(highest_m(simulation), 0.065) << tilt_rad;
    EXPECT_LT(not_met, 15u) << tilt_rad;
  }
}

// The height of the upper surface where the probe presses: that of its vertex nearest to the probe's axis.
double height_under_probe_m(const Simulation& simulation) {
  const Eigen::Vector2f axis_m(0.001F, 0.002F);
  double nearest_m = 1, height_m = 0;
  for (const Vec3f& x : simulation.positions_world_m(0))
    if (const double away_m = (x.head<2>() - axis_m).norm(); x.z() > 0.02F && away_m < nearest_m) {
      nearest_m = away_m;
      height_m = double{x.z()};
    }
  return height_m;
}

TEST_P(VolumeModels, a_probe_dents_them_feels_it_and_they_come_back) {
  Scene scene = block_on_table(GetParam());
  scene.tools.emplace_back();
  scene.tools[0].name = "probe";
  scene.tools[0].kind = "probe";
  scene.tools[0].geometry = instrument_of("probe").geometry;
  Simulation simulation(prepared(scene));
  std::uint64_t n = 0;
  double force_n = 0;
  const auto move_tip = [&](double from_z_m, double to_z_m, int steps) {
    for (int i = 1; i <= steps; ++i) {
      const double z_m = from_z_m + (to_z_m - from_z_m) * i / steps;
      StepInput input;
      ++n;
      input.samples = {{0, n, 0.001 * static_cast<double>(n), Pose{Vec3(0.001, 0.002, z_m)}, 0}};
      force_n = 0;
      for (const ContactModel& c : simulation.step(input).contacts) force_n = c.force_world_n.z();
    }
  };
  move_tip(0.05, 0.05, 300);
  const double rest_m = height_under_probe_m(simulation);
  EXPECT_EQ(force_n, 0);
  move_tip(0.05, 0.035, 225);
  move_tip(0.035, 0.035, 200);
  const double half_n = force_n;
  EXPECT_GT(half_n, 0.01);
  move_tip(0.035, 0.030, 75);
  move_tip(0.030, 0.030, 200);
  EXPECT_GT(force_n, 1.1 * half_n);  // tetrahedra of springs buckle in compression, and hardly harden
  EXPECT_LT(force_n, 2);
  EXPECT_LT(height_under_probe_m(simulation), rest_m - 0.003);
  move_tip(0.030, 0.05, 300);
  move_tip(0.05, 0.05, 300);
  EXPECT_EQ(force_n, 0);
  EXPECT_NEAR(height_under_probe_m(simulation), rest_m, 0.0005);
}

TEST(Volume, templates_are_refused_and_said_so) {
  Scene scene = block_on_table("neo_hookean");
  scene.bodies[0].cutting.style = "templates";
  EXPECT_THROW(prepared(scene), InputError);
}

TEST(Volume, tetrahedra_from_a_file_are_the_body) {
  Scene scene = prepared(block_on_table("neo_hookean"));
  const TetMesh& tets = scene.bodies[0].tets;
  const std::string path = testing::TempDir() + "/sectio_volume_test.msh";
  write_tet_file(path, tets);
  Scene from_file = block_on_table("neo_hookean");
  from_file.bodies[0].mesh = {};
  from_file.bodies[0].volume.file = path;
  const Simulation simulation(prepared(from_file));
  EXPECT_EQ(simulation.mesh(0).vertex_count(), scene.bodies[0].mesh.vertices_body_m.size());
  EXPECT_NEAR(check(simulation.mesh(0)).volume_m3, check(tets).volume_m3, 1e-12);
  for (const double unit_m : {0.001, 1000.0}) {
    from_file.bodies[0].volume.file_unit_m = unit_m;
    EXPECT_THROW(prepared(from_file), InputError) << "no part of a patient is so small, or so large";
  }
}

TEST(Volume, a_lattice_says_when_its_tetrahedra_are_coarse_for_its_cells) {
  for (const double tetrahedra : {800.0, 9000.0}) {
    Scene scene = block_on_table("neo_hookean_lattice");
    scene.bodies[0].volume.cell_m = 0.005;
    scene.bodies[0].volume.tetrahedra = tetrahedra;
    EXPECT_EQ(prepared(scene).bodies[0].mesh_notes.back().find("coarse for these") != std::string::npos,
              tetrahedra < 4000);
  }
}

TEST(Volume, what_can_t_be_filled_is_refused_with_scene_and_body) {
  Scene scene = block_on_table("neo_hookean");
  scene.file = "a.yaml";
  scene.bodies[0].contact.style = "templates";
  EXPECT_THROW(Simulation{prepared(scene)}, InputError);
  scene.bodies[0].contact.style = "vertices";
  scene.bodies[0].volume.file = "nothing.msh";
  try {
    const Simulation simulation(prepared(scene));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "a.yaml: body 'block': nothing.msh: no such file");
  }
}

}  // namespace
}  // namespace sectio::simulation_test
