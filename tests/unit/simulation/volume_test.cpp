// Bodies that are volumes of tetrahedra, through the whole simulation.
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/volume/volume_engines.h"

#include <gtest/gtest.h>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/simulation.h"
#include "tests/support/block_scene.h"

namespace sectio {
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
  Simulation simulation(fill_volumes(block_on_table(GetParam())));
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

TEST_P(VolumeModels, a_probe_dents_them_and_feels_it) {
  Scene scene = block_on_table(GetParam());
  scene.tools.emplace_back();
  scene.tools[0].name = "probe";
  scene.tools[0].kind = "probe";
  scene.tools[0].geometry = instrument_of("probe").geometry;
  Simulation simulation(fill_volumes(scene));
  StepInput input;
  double force_n = 0;
  for (std::uint64_t n = 1; n <= 800; ++n) {
    const double depth = std::max(0.0, std::min(1.0, (static_cast<double>(n) - 300) / 300)) * 0.02;
    input.samples = {{0, n, 0.001 * static_cast<double>(n), Pose{Vec3(0.001, 0.002, 0.05 - depth)}, 0}};
    const StepOutput& out = simulation.step(input);
    for (const ContactModel& c : out.contacts) force_n = c.force_world_n.z();
  }
  EXPECT_GT(force_n, 0.02);
  EXPECT_LT(force_n, 2);
}

TEST(Volume, templates_are_refused_and_said_so) {
  Scene scene = block_on_table("neo_hookean");
  scene.bodies[0].cutting.style = "templates";
  EXPECT_THROW(fill_volumes(scene), InputError);
}

TEST(Volume, tetrahedra_from_a_file_are_the_body) {
  Scene scene = fill_volumes(block_on_table("neo_hookean"));
  const TetMesh& tets = scene.bodies[0].tets;
  const std::string path = testing::TempDir() + "/sectio_volume_test.msh";
  write_tet_file(path, tets);
  Scene from_file = block_on_table("neo_hookean");
  from_file.bodies[0].mesh = {};
  from_file.bodies[0].volume.file = path;
  const Simulation simulation(fill_volumes(from_file));
  EXPECT_EQ(simulation.mesh(0).vertex_count(), scene.bodies[0].mesh.vertices_body_m.size());
  EXPECT_NEAR(check(simulation.mesh(0)).volume_m3, check(tets).volume_m3, 1e-12);
}

TEST(Volume, what_can_t_be_filled_is_refused_with_scene_and_body) {
  Scene scene = block_on_table("neo_hookean");
  scene.file = "a.yaml";
  scene.bodies[0].contact.style = "templates";
  EXPECT_THROW(Simulation{fill_volumes(scene)}, InputError);
  scene.bodies[0].contact.style = "vertices";
  scene.bodies[0].volume.file = "nothing.msh";
  try {
    const Simulation simulation(fill_volumes(scene));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "a.yaml: body 'block': nothing.msh: no such file");
  }
}

}  // namespace
}  // namespace sectio
