#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/choose_model.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/prepare/kept_plans.h"
#include "sim_server/prepare/machine_speed.h"
#include "sim_server/prepare/weighed_body.h"
#include "sim_server/simulation.h"
#include "tests/support/shapes.h"

namespace sectio::prepare_test {
namespace {

namespace fs = std::filesystem;

Scene bar_scene() {
  Scene scene;
  scene.file = "bar";
  scene.bodies.emplace_back();
  BodySpec& bar = scene.bodies[0];
  bar.name = "bar";
  bar.model = "auto";
  bar.mesh = test::box(8, 2, 2, Vec3(0.08, 0.02, 0.02));
  bar.material.young_pa = 20000;
  bar.fixed = Box{Vec3(-1, -1, -1), Vec3(0.001, 1, 1)};
  bar.plan.error_budget = 0.05;
  return scene;
}

// With a cache of its own.
class Plans : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("sectio_cache_" + std::to_string(getpid()));
    const char* cache = std::getenv("XDG_CACHE_HOME");
    before_ = cache ? cache : "";
    setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  }
  void TearDown() override {
    before_.empty() ? unsetenv("XDG_CACHE_HOME") : setenv("XDG_CACHE_HOME", before_.c_str(), 1);
    fs::remove_all(folder_);
  }
  std::string text_of_cache() const {
    std::ifstream in(folder_ / "sectio" / "calibration.txt");
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_;
  std::string before_;
};

TEST_F(Plans, scene_gets_a_model_and_runs) {
  const PlannedScene planned = plan_scene(bar_scene(), standard_engines());
  const BodySpec& bar = planned.scene.bodies[0];
  EXPECT_NE(bar.model, "auto");
  EXPECT_LE(bar.plan.error_estimate.value(), 0.05);
  EXPECT_GT(bar.plan.cpu_estimate.value(), 0);
  EXPECT_NE(planned.table.find("> "), std::string::npos) << planned.table;
  EXPECT_NE(planned.table.find("taken: "), std::string::npos) << planned.table;

  Simulation simulation(fill_volumes(planned.scene));
  static int asked = 0;
  simulation.measure_with([] { return ++asked * 0.0005; });  // each stage of a step takes half a millisecond
  const StepOutput* out = nullptr;
  for (int i = 0; i < 600; ++i) out = &simulation.step({});
  ASSERT_EQ(out->report.checks.size(), 1u);
  const BodyCheck& check = out->report.checks[0];
  EXPECT_EQ(check.error_estimate, *bar.plan.error_estimate);
  EXPECT_EQ(check.cpu_estimate, *bar.plan.cpu_estimate);
  const double took_s = asked / 2 * 0.0005;  // the clock is asked before and after a stage
  EXPECT_NEAR(check.cpu, took_s / 0.6, 1e-6);
  EXPECT_NEAR(out->report.processor_s[0], took_s, 1e-6);
  EXPECT_GE(check.stability_margin, 1);
  EXPECT_LT(check.energy_gain_j, 1e-6) << "nothing pushes it";
}

TEST_F(Plans, scene_without_auto_stays_as_it_is_and_auto_alone_is_no_model) {
  Scene scene = bar_scene();
  EXPECT_THROW(Simulation{fill_volumes(scene)}, InputError);
  scene.bodies[0].model = "neo_hookean";
  const PlannedScene planned = plan_scene(scene, standard_engines());
  EXPECT_EQ(planned.scene.bodies[0].model, "neo_hookean");
  EXPECT_TRUE(planned.table.empty());
  EXPECT_TRUE(text_of_cache().empty()) << "nothing was measured";
}

TEST_F(Plans, free_step_is_the_longest_that_models_without_auto_can_take) {
  Scene scene = bar_scene();
  scene.step_is_free = true;
  scene.step_s = 2.5e-4;
  for (const char* model : {"surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"}) {
    for (const char* driver : {"automatic", "implicit"}) {
      scene.bodies[0].model = model;
      scene.bodies[0].volume.driver = driver;
      scene.bodies[0].material.young_pa = 1e6;  // beyond a step of 1 ms in one part
      const PlannedScene planned = plan_scene(scene, standard_engines());
      EXPECT_EQ(planned.scene.step_s, 1e-3) << model;
      EXPECT_NO_THROW(Simulation{fill_volumes(planned.scene)}.step({})) << model;
    }
  }
  EXPECT_TRUE(text_of_cache().empty()) << "nothing was measured";
  scene.bodies[0].model = "surface_springs";
  scene.bodies[0].material.young_pa = 3e8;
  EXPECT_LT(plan_scene(scene, standard_engines()).scene.step_s, 1e-3);
  scene.bodies[0].material.young_pa = 1e12;
  EXPECT_THROW(plan_scene(scene, standard_engines()), InputError);
}

TEST_F(Plans, free_step_is_one_that_surface_springs_can_take) {
  Scene scene = bar_scene();
  scene.gravity_m_per_s2.setZero();
  scene.step_is_free = true;
  BodySpec stiff = scene.bodies[0];
  stiff.name = "stiff";
  stiff.model = "surface_springs";
  stiff.material.young_pa = 3e8;
  scene.bodies.push_back(stiff);
  const PlannedScene planned = plan_scene(scene, standard_engines());
  EXPECT_LT(planned.scene.step_s, 1e-3);
  EXPECT_NO_THROW(Simulation{fill_volumes(planned.scene)});
}

TEST_F(Plans, model_of_another_table_is_measured_and_chosen) {
  EngineTable engines = standard_engines();
  ModelEntry exact = engines.model("tetra_springs");
  exact.traits.name = "exact_springs";
  exact.methods[0].name = "exact";
  for (planning::LoadLaw& law : exact.methods[0].laws) law.law = {0, 1, 1e-4};
  engines.models.push_back(exact);
  Scene scene = bar_scene();
  scene.bodies[0].plan.error_budget = 1e-3;
  scene.bodies[0].plan.cpu_budget = 20;
  EXPECT_NE(plan_scene(scene, engines).scene.bodies[0].model, "exact_springs") << "weighing shows that it isn't exact";
  scene.bodies[0].fixed.reset();  // laws are believed as nothing can be weighed
  const PlannedScene planned = plan_scene(scene, engines);
  EXPECT_EQ(planned.scene.bodies[0].model, "exact_springs") << planned.table;
  EXPECT_NE(text_of_cache().find("exact "), std::string::npos);
}

TEST(WeighedBody, a_body_that_stays_where_it_is_has_an_error_of_all_that_it_should_move) {
  const BodySpec bar = bar_scene().bodies[0];
  const WeighedBody weighed(bar, planning::shape_of(bar.mesh), Vec3(0, 0, -9.81));
  std::vector<SagPoint> stays;
  for (const Vec3& p : bar.mesh.vertices_body_m)
    if (p.x() > 0.04) stays.push_back({p, Vec3::Zero(), 1e-3});
  const auto error = weighed.error_of(stays);
  ASSERT_TRUE(error);
  EXPECT_GT(*error, 0.5);
  EXPECT_LT(*error, 1.5);
  EXPECT_FALSE(weighed.error_of({})) << "nobody knows";
}

TEST_F(Plans, second_planning_of_the_same_scene_reads_the_first) {
  const std::vector<planning::Method> methods = standard_engines().methods();
  const PlannedScene first = plan_scene(bar_scene(), standard_engines());
  const planning::Calibration speed = calibration_of_this_machine(standard_engines());
  const std::uint64_t key = plan_key(bar_scene(), methods, to_text(speed, {}));
  auto kept = kept_plan(key);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->table, first.table);
  kept->table += "read from disk\n";
  keep_plan(key, *kept);
  const PlannedScene second = plan_scene(bar_scene(), standard_engines());
  EXPECT_EQ(second.table, kept->table);
  const BodySpec &one = first.scene.bodies[0], &other = second.scene.bodies[0];
  EXPECT_EQ(one.model, other.model);
  EXPECT_EQ(one.volume.cell_m, other.volume.cell_m);
  EXPECT_EQ(one.volume.tetrahedra, other.volume.tetrahedra);
  EXPECT_EQ(one.plan.error_estimate, other.plan.error_estimate);
  EXPECT_EQ(one.plan.cpu_estimate, other.plan.cpu_estimate);
  EXPECT_EQ(first.scene.step_s, second.scene.step_s);
}

TEST_F(Plans, torn_and_foreign_plans_are_planned_anew) {
  const PlannedScene first = plan_scene(bar_scene(), standard_engines());
  fs::path file;
  for (const auto& entry : fs::directory_iterator(folder_ / "sectio" / "plans")) file = entry.path();
  ASSERT_FALSE(file.empty());
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const std::string& damaged : {text.substr(0, text.size() / 2), std::string(), std::string("another program's"),
                                     std::string(text).replace(text.find('\n') + 1, 4, "0000")}) {
    std::ofstream(file) << damaged;
    EXPECT_EQ(plan_scene(bar_scene(), standard_engines()).table, first.table);
    std::ifstream again(file);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), text) << "mended";
  }
}

TEST_F(Plans, key_depends_on_everything_that_a_plan_does) {
  const std::vector<planning::Method> methods = standard_engines().methods();
  const std::uint64_t key = plan_key(bar_scene(), methods, "speed");
  EXPECT_EQ(plan_key(bar_scene(), methods, "speed"), key);
  EXPECT_NE(plan_key(bar_scene(), methods, "another speed"), key);
  const std::function<void(Scene&)> changes[] = {
      [](Scene& s) { s.step_s = 2e-3; },
      [](Scene& s) { s.gravity_m_per_s2.z() = -1; },
      [](Scene& s) { s.floor_z_m = 0; },
      [](Scene& s) { s.bodies[0].mesh.vertices_body_m[3].x() += 1e-9; },
      [](Scene& s) { s.bodies[0].material.young_pa += 1; },
      [](Scene& s) { s.bodies[0].fixed.reset(); },
      [](Scene& s) { s.bodies[0].plan.error_budget = 0.06; },
      [](Scene& s) { s.bodies[0].cutting.style = "semi_progressive"; },
      [](Scene& s) { s.bodies[0].pose.position_m.z() = 0.01; },
      [](Scene& s) { s.tools.emplace_back(); },
  };
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    Scene changed = bar_scene();
    changes[i](changed);
    EXPECT_NE(plan_key(changed, methods, "speed"), key) << i;
  }
}

TEST_F(Plans, machine_is_measured_once_and_damaged_caches_are_measured_anew) {
  const planning::Calibration first = calibration_of_this_machine(standard_engines());
  const std::string text = text_of_cache();
  ASSERT_FALSE(text.empty());
  ASSERT_EQ(first.rate.size(), 6u);
  for (const auto& [method, rate] : first.rate) EXPECT_GT(rate.element_ns, 0) << method;
  EXPECT_EQ(calibration_of_this_machine(standard_engines()).rate["neo_hookean"].element_ns,
            std::stod(formatted("%.6g", first.rate.at("neo_hookean").element_ns)));
  std::ofstream(folder_ / "sectio" / "calibration.txt") << text.substr(0, text.size() / 2);
  calibration_of_this_machine(standard_engines());
  EXPECT_EQ(text_of_cache().size() > text.size() / 2 + 5, true) << text_of_cache();
}

TEST(CalibrationText, is_read_back_and_nothing_else) {
  planning::Calibration c;
  c.rate["springs"] = c.rate["solid"] = {1.5, 2.5, 0.25};
  c.touched_vertex_ns = 3;
  const std::string text = to_text(c, "some processor");
  auto read = calibration_from(text, "some processor");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->rate["solid"].vertex_ns, 2.5);
  EXPECT_EQ(read->touched_vertex_ns, 3);
  EXPECT_FALSE(calibration_from(text, "another processor"));
  for (std::size_t n = 0; n + 1 < text.size(); ++n) EXPECT_FALSE(calibration_from(text.substr(0, n), "some processor"));
  std::string bad = text;
  bad.replace(bad.find("1.5"), 3, "nan");
  EXPECT_FALSE(calibration_from(bad, "some processor"));
}

}  // namespace
}  // namespace sectio::prepare_test
