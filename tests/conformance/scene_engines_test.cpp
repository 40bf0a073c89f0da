// Engines that a scene file names and that the product does not know: a volume model with its own cutting, a process in
// a body, an engine between two bodies, and the scalars that they publish (paper A, section 2: engines are added
// without touching another).
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "sim_server/surface/surface_engines.h"
#include "tests/support/scene_engines.h"

namespace sectio::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"(session: own_engines
step_s: 0.001
duration_s: 1
bodies:
  - name: upper
    mesh: {file: cube.obj, unit: cm}
    pose: {position_world_m: [0, 0, 0.05]}
    model: clay
    creep_per_s: 5
    volume: {tetrahedra: 200}
  - name: lower
    mesh: {file: cube.obj, unit: cm}
    model: surface_springs
processes:
  - {name: warm, kind: warmth, bodies: [lower], warms_k_per_s: 2}
  - {name: drip, kind: leak, bodies: [upper, lower], water_ml: 1.5}
)";

EngineTable table_with_own_engines() {
  EngineTable table = standard_engines();
  table.models.push_back({{.name = "clay",
                           .meaning = "Keeps the form that instruments give it, and creeps home.",
                           .needs_volume = true,
                           .keys = {{.name = "creep_per_s",
                                     .meaning = "Share of the way home in a second.",
                                     .range = above(0),
                                     .required = true}}},
                          [](const EngineSite& site) {
                            BodyEngines engines = surface_spring_engines(site);
                            engines.deformation =
                                std::make_unique<Clay>(site.spec.tets, site.frame_world, site.spec.material,
                                                       site.spec.options.number("creep_per_s"), site.scene.step_s);
                            return engines;
                          }});
  table.processes.push_back({{.kind = "warmth",
                              .meaning = "Warms a body.",
                              .most_bodies = 8,
                              .keys = {{.name = "warms_k_per_s", .meaning = "How fast.", .default_value = 1.0}}},
                             [](const ProcessSite& site) {
                               return std::make_unique<Warmth>(site.body, site.spec.options.number("warms_k_per_s"));
                             },
                             {}});
  table.processes.push_back({{.kind = "leak",
                              .meaning = "Lets water run from the first body into the second.",
                              .fewest_bodies = 2,
                              .most_bodies = 2,
                              .keys = {{.name = "water_ml", .meaning = "In the first body.", .required = true},
                                       {.name = "flow_ml_per_s", .meaning = "How fast.", .default_value = 2.0}}},
                             {},
                             [](const WorldEngineSite& site) {
                               const Options& o = site.spec.options;
                               return std::make_unique<Leak>(site.bodies, o.number("water_ml"),
                                                             o.number("flow_ml_per_s"));
                             }});
  return table;
}

class SceneEngines : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "sectio_engines_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    std::ofstream(folder_ / "cube.obj") << "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nv 0 0 2\nv 2 0 2\nv 0 2 2\nv 2 2 2\n"
                                           "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::ofstream(folder_ / "scene.yaml") << kScene;
  }
  void TearDown() override { fs::remove_all(folder_); }

  Scene scene() const { return prepared(load_scene((folder_ / "scene.yaml").string(), table_.traits()), table_); }

  EngineTable table_ = table_with_own_engines();
  fs::path folder_;
};

TEST_F(SceneEngines, a_volume_model_of_ones_own_gets_its_volume_and_its_keys) {
  const Scene ready = scene();
  EXPECT_GT(ready.bodies[0].tets.tetrahedra.size(), 100u);
  EXPECT_TRUE(ready.bodies[1].tets.tetrahedra.empty());
  Simulation simulation(ready, table_);
  for (int i = 0; i < 50; ++i) simulation.step({});
  const auto positions = simulation.positions_world_m(0);
  for (VertexId v = 0; v < positions.size(); ++v)
    EXPECT_NEAR((positions[v].cast<double>() - Vec3(0, 0, 0.05) - simulation.mesh(0).rest_body_m(v)).norm(), 0, 1e-6)
        << "clay has no weight";
}

TEST_F(SceneEngines, processes_in_bodies_and_between_them_publish_scalars) {
  Simulation simulation(scene(), table_);
  for (int i = 0; i < 500; ++i) simulation.step({});
  const std::vector<ScalarField> upper = simulation.scalars(0), lower = simulation.scalars(1);
  ASSERT_EQ(upper.size(), 1u);
  ASSERT_EQ(lower.size(), 2u);
  EXPECT_EQ(upper[0].name, "wetness");
  EXPECT_EQ(lower[0].name, "temperature");
  EXPECT_EQ(lower[1].name, "wetness");
  ASSERT_EQ(lower[0].values.size(), simulation.mesh(1).vertex_slots());
  EXPECT_NEAR(lower[0].values[0], 1, 1e-4) << "2 K/s for half a second";
  EXPECT_NEAR(upper[0].values[0], 0.5, 1e-4) << "1 of 1.5 ml has run down";
  EXPECT_NEAR(lower[1].values[0], 1, 1e-4);
}

TEST_F(SceneEngines, a_key_of_an_engine_that_is_missing_is_named) {
  std::string text = kScene;
  text.erase(text.find(", water_ml: 1.5"), 15);
  std::ofstream(folder_ / "scene.yaml") << text;
  try {
    scene();
    FAIL() << "water_ml is required";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("processes[1].water_ml: missing"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace sectio::test
