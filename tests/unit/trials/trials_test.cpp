// Rates over runs, each in a process of its own.
#include "sim_server/trials/trials.h"

#include <gtest/gtest.h>

#include <unistd.h>
#include <csignal>
#include <cstdlib>

#include <filesystem>

#include "common/core/error.h"
#include "common/core/stop_signal.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/trials/write_scene.h"

namespace sectio::trials_test {
namespace {

Scene shipped(const char* name) {
  Scene scene = prepared(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/" + std::string(name), standard_traits()));
  scene.duration_s = 0.01;
  scene.expect.clear();
  return scene;
}

TEST(Trials, wilsons_interval) {
  const Interval all = wilson({100, 100}), half = wilson({5, 10});
  EXPECT_NEAR(all.low, 0.9630, 1e-4);
  EXPECT_EQ(all.high, 1);
  EXPECT_NEAR(half.low, 0.2366, 1e-4);
  EXPECT_NEAR(half.high, 0.7634, 1e-4);
  EXPECT_EQ(wilson({0, 10}).low, 0);
}

TEST(Trials, every_seed_is_played_once_and_what_fails_says_why) {
  Scene scene = shipped("bar_volume_falls.yaml");
  scene.expect = {{&measures().front(), between(1, 1)}};  // no incision can be there yet
  int ended = 0;
  const auto trials = run_trials(scene, {.runs = 3, .seed = 5, .processes = 2}, [&](const Trial&) { ++ended; });
  EXPECT_EQ(ended, 3);
  ASSERT_EQ(trials.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(trials[i].seed, 5 + i);
    EXPECT_EQ(trials[i].reasons, std::vector<std::string>{"incisions: expected 1, got 0"});
  }
  EXPECT_EQ(rate_of(trials).good, 0u);
  scene.expect.clear();
  EXPECT_EQ(rate_of(run_trials(scene, {.runs = 2}, [](const Trial&) {})).good, 2u);
}

TEST(Trials, that_are_stopped_leave_those_that_have_ended) {
  const auto two_of_many = [] {
    catch_stop_signals();
    int ended = 0;
    const auto trials = run_trials(shipped("bar_volume_falls.yaml"), {.runs = 1000, .processes = 2}, [&](const Trial&) {
      if (++ended == 2) raise(SIGINT);
    });
    std::_Exit(trials.size() == 2 && rate_of(trials).good == 2 ? 0 : 1);
  };
  EXPECT_EXIT(two_of_many(), testing::ExitedWithCode(0), "");
}

TEST(Trials, a_run_that_is_refused_or_does_not_end_is_a_failure) {
  Scene refused = shipped("liver_incision.yaml");
  refused.step_s = 0.1;  // beyond the stable one
  auto trials = run_trials(refused, {.runs = 2}, [](const Trial&) {});
  EXPECT_EQ(rate_of(trials).good, 0u);
  EXPECT_FALSE(trials[1].reasons.empty());
  Scene endless = shipped("bar_volume_falls.yaml");
  endless.duration_s = 1e6;
  trials = run_trials(endless, {.runs = 1, .processor_limit_s = 1}, [](const Trial&) {});
  EXPECT_EQ(trials[0].reasons, std::vector<std::string>{"did not end within 1 s of processor"});
}

TEST(Trials, a_failure_becomes_a_scene_that_repeats_it) {
  const Scene scene = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/tilted_kidney.yaml", standard_traits());
  const Scene played =
      in_hand(scene, {.shift_m = 0.001, .turn_deg = 3, .slower = 3, .tremor_m = 0.0003, .lifts = 2}, 9);
  const auto directory = std::filesystem::temp_directory_path() / ("try_" + std::to_string(::getpid()));
  write_scene(played, directory.string());
  const Scene again = load_scene((directory / "scene.yaml").string(), standard_traits());
  std::filesystem::remove_all(directory);
  EXPECT_EQ(again.duration_s, played.duration_s);
  ASSERT_EQ(again.tools.size(), played.tools.size());
  for (std::size_t i = 0; i < again.tools.size(); ++i) EXPECT_TRUE(again.tools[i].trace == played.tools[i].trace);
  EXPECT_EQ(again.gravity_changes[0].at_s, played.gravity_changes[0].at_s);
  EXPECT_EQ(again.bodies[0].mesh.triangles.size(), scene.bodies[0].mesh.triangles.size());
  EXPECT_EQ(again.expect.size(), scene.expect.size());
}

TEST(Trials, the_scene_of_a_failure_names_tetrahedra_wherever_it_lies) {
  const Scene scene = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/paper_box.yaml", standard_traits());
  const auto directory = std::filesystem::temp_directory_path() / ("try_box_" + std::to_string(::getpid()));
  write_scene(scene, directory.string());
  const Scene again = load_scene((directory / "scene.yaml").string(), standard_traits());
  std::filesystem::remove_all(directory);
  EXPECT_TRUE(std::filesystem::path(again.bodies[0].volume.file).is_absolute());
  EXPECT_EQ(again.bodies[0].volume.file_unit_m, scene.bodies[0].volume.file_unit_m);
}

}  // namespace
}  // namespace sectio::trials_test
