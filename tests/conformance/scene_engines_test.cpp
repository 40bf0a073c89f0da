// Engines that a scene file names and that the product does not know: a volume model with its own cutting, a process in
// a body, an engine between two bodies, and the scalars that they publish (paper A, section 2: engines are added
// without touching another).
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "common/core/error.h"
#include "common/delta/journal.h"
#include "common/mesh/check.h"
#include "sim_server/session/recorder.h"
#include "sim_server/session/replay.h"
#include "tests/support/operation.h"
#include "tests/support/scene_engines.h"

namespace sectio::test {
namespace {

class SceneEngines : public testing::Test {
 protected:
  Scene scene() const { return file_.load(table_); }

  EngineTable table_ = table_with_own_engines();
  OwnEnginesScene file_;
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
  std::string text = OwnEnginesScene::text();
  text.erase(text.find(", water_ml: 1.5"), 15);
  try {
    file_.load(table_, text);
    FAIL() << "water_ml is required";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("processes[1].water_ml: missing"), std::string::npos) << error.what();
  }
}

TEST_F(SceneEngines, a_model_of_ones_own_cuts_in_its_own_way) {
  Operation operation(scene(), table_);
  const std::uint32_t vertices = operation.mesh(0).vertex_count(), triangles = operation.mesh(0).triangle_count();
  const double top_m = 0.07;
  operation.place(Vec3(0.011, 0.008, top_m + 0.002));
  operation.move(Vec3(0.011, 0.008, top_m - 0.008), 0.02);
  // A prick is over at once, and a blade that goes deeper breaks in anew.
  const auto pricks = static_cast<std::uint32_t>(operation.count(EventKind::penetrated));
  EXPECT_GE(pricks, 1u);
  EXPECT_EQ(operation.mesh(0).vertex_count(), vertices + pricks);
  EXPECT_EQ(operation.mesh(0).triangle_count(), triangles + 2 * pricks);
  EXPECT_TRUE(check(operation.mesh(0)).valid());
  EXPECT_EQ(operation.simulation.scalars(0).at(0).values.size(), operation.mesh(0).vertex_slots());
}

TEST_F(SceneEngines, the_journal_of_a_run_holds_the_scalars_and_replay_tells_them) {
  const Scene ready = scene();
  Simulation simulation(ready, table_);
  Recorder recorder(ready, simulation, file_.folder() + "/out");
  recorder.begin_journal();
  for (int i = 0; i < 700; ++i) recorder.add(simulation.step({}), 0);
  recorder.finish();
  const std::vector<JournalScalars> scalars = read_scalars(file_.folder() + "/out/journal");
  ASSERT_EQ(scalars.size(), 3u);
  for (const JournalScalars& s : scalars) {
    EXPECT_EQ(s.step, 700u);
    const std::vector<ScalarField> fields = simulation.scalars(s.body_id);
    EXPECT_NE(std::ranges::find(fields, s.field), fields.end()) << s.field.name;
  }
  std::string damage;
  const std::string told = replay(file_.folder() + "/out/journal", file_.folder() + "/replayed", damage);
  EXPECT_EQ(damage, "");
  EXPECT_NE(told.find("lower: temperature at step 700: 1.4 to 1.4, mean 1.4\n"), std::string::npos) << told;
  std::ifstream csv(file_.folder() + "/replayed/lower.temperature.csv");
  std::string head, first;
  EXPECT_TRUE(std::getline(csv, head) && std::getline(csv, first));
  EXPECT_EQ(head, "vertex,temperature");
  EXPECT_EQ(first, "0,1.4");
}

}  // namespace
}  // namespace sectio::test
