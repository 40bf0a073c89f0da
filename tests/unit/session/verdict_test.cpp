// Whether a run was well: what the report and the exit code say.
#include "sim_server/session/verdict.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sim_server/prepare/prepare.h"
#include "sim_server/session/recorder.h"
#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio::session_test {
namespace {

TEST(Verdict, a_run_that_was_well_is_ok_and_the_reasons_of_another_are_named) {
  Scene scene = test::organ_scene();
  const Simulation simulation(scene);
  RunFigures figures;
  EXPECT_TRUE(reasons_against(figures, scene, simulation).empty());
  figures.last.drivers = {{0.12, 0, 7}};
  figures.body_added_mass = {0.12};
  figures.body_residual = {21};
  figures.events[to_string(EventKind::body_frozen)] = 2;
  figures.last.cuts_refused = 3;
  figures.largest_force_n = NAN;
  const std::vector<std::string> reasons = reasons_against(figures, scene, simulation);
  ASSERT_EQ(reasons.size(), 6u);
  EXPECT_EQ(reasons[0], "7 steps of organ left a residual above the tolerance");
  EXPECT_EQ(reasons[1], "a step of organ left a residual of 21.0 times the weight") << "0.2 m/s in a millisecond";
  EXPECT_EQ(reasons[2], "12 % of mass was added to organ");
  EXPECT_EQ(reasons[3], "a force was not finite");
  EXPECT_EQ(reasons[4], "2 times a body froze");
  EXPECT_EQ(reasons[5], "3 cuts were refused");
  EXPECT_EQ((RunResult{"", reasons}.exit_code()), kExitNotOk);
  EXPECT_EQ((RunResult{"", {}}.exit_code()), 0);
}

TEST(Verdict, a_body_that_has_lost_a_fifth_of_its_volume_is_named) {
  Scene scene = test::block_scene("neo_hookean");
  scene.bodies[0].material.poisson = 0;
  scene.bodies[0].pose.position_m.z() = 0.001;
  const auto squeezed_by = [&](double gravity_m_per_s2) {
    scene.gravity_m_per_s2 = Vec3(0, 0, -gravity_m_per_s2);
    const Scene ready = prepared(scene);
    Simulation simulation(ready);
    for (int n = 0; n < 300; ++n) simulation.step({});
    return reasons_against({}, ready, simulation);
  };
  EXPECT_TRUE(squeezed_by(9.81).empty());
  const std::vector<std::string> reasons = squeezed_by(300);
  ASSERT_EQ(reasons.size(), 1u);
  EXPECT_TRUE(reasons[0].starts_with("block has ") && reasons[0].ends_with(" % of its volume")) << reasons[0];
}

TEST(Verdict, a_thread_that_is_longer_than_its_body_was_flung_out) {
  const TriangleMesh ball(test::ellipsoid(3, Vec3::Constant(0.05)));
  std::vector<Vec3> now;
  for (VertexId v = 0; v < ball.vertex_slots(); ++v) now.push_back(2 * ball.rest_body_m(v));
  EXPECT_EQ(flung_thread_m(ball, now), 0);
  now[7] *= 4;
  EXPECT_NEAR(flung_thread_m(ball, now), 0.3, 0.03);
}

TEST(Verdict, what_the_scene_expects_counts_once_the_run_was_whole) {
  Scene scene = test::organ_scene();
  const Simulation simulation(scene);
  const auto measure = [](const char* key) { return &*std::ranges::find(measures(), key, &Measure::key); };
  scene.expect = {{measure("incisions"), between(1, 1)}, {measure("refusals"), {.high = 2}}};
  RunFigures figures;
  figures.last.cuts_refused = 2;
  figures.outcome.refusals = 2;
  figures.steps = static_cast<std::uint64_t>(scene.duration_s / scene.step_s) - 1;
  EXPECT_TRUE(reasons_against(figures, scene, simulation).empty());
  ++figures.steps;
  EXPECT_EQ(reasons_against(figures, scene, simulation), std::vector<std::string>{"incisions: expected 1, got 0"});
  figures.outcome.incisions = 1;
  EXPECT_TRUE(reasons_against(figures, scene, simulation).empty());
  figures.outcome.refusals = NAN;
  EXPECT_EQ(reasons_against(figures, scene, simulation),
            std::vector<std::string>{"refusals: expected at most 2, got nan"});
}

// A vessel that is marked all along its line and still whole isn't divided.
TEST(Verdict, a_score_judges_all_that_the_scene_expects) {
  Scene scene = test::organ_scene();
  scene.exercise.emplace();
  for (const Measure& m : measures())
    if (m.key == "pieces_freed" || m.key == "healthy_lost_ml") scene.expect.push_back({&m, at_least(0)});
  scene.expect.front().range = between(1, 1);
  Simulation simulation(scene);
  Recorder record(scene, simulation, "");
  record.add(simulation.step({}), 0);
  const auto lines = record.score_lines();
  const auto says = [&](const char* start, const char* target) {
    return std::ranges::any_of(
        lines, [&](const std::string& l) { return l.starts_with(start) && l.find(target) != std::string::npos; });
  };
  EXPECT_TRUE(says("missed", "pieces freed 1: 0"));
  EXPECT_TRUE(says("reached", "healthy lost"));
  EXPECT_EQ(task_in_words("", scene.expect).size(), 2u);
}

TEST(Verdict, the_report_says_ok) {
  const Scene scene = test::organ_scene();
  Simulation simulation(scene);
  Recorder record(scene, simulation, "");
  record.add(simulation.step({}), 0);
  const RunResult result = record.finish();
  const auto report = nlohmann::json::parse(result.report);
  EXPECT_EQ(report.at("ok"), true);
  EXPECT_TRUE(report.at("reasons").empty());
  EXPECT_TRUE(result.reasons.empty());
}

}  // namespace
}  // namespace sectio::session_test
