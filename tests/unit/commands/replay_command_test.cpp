#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "sim_server/commands/recorded_scene.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/offline_run.h"
#include "tests/unit/commands/run_command.h"

namespace sectio::commands_test {
namespace {

// Five steps of a scene, and then again from the directory of their export.
std::string replayed(const std::string& name) {
  const std::string folder = testing::TempDir() + "/sectio_replay_" + std::to_string(::getpid());
  Scene scene = prepared(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/" + name, standard_traits()));
  scene.session = "of_that_time";
  EXPECT_EQ(run_offline(scene, 5, folder).report.empty(), false);
  EXPECT_EQ(recorded_scene(journal_at(folder)).session, "of_that_time");
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_command("replay", replay_command, {folder}), 0);
  std::filesystem::remove_all(folder);
  return testing::internal::GetCapturedStdout();
}

TEST(ReplayCommand, takes_the_inputs_in_the_directory_of_an_export) {
  const std::string text = replayed("bar_volume_falls.yaml");
  EXPECT_EQ(text.substr(0, 8), "5 steps\n");
  EXPECT_EQ(text.find("reached"), std::string::npos) << text;
}

TEST(ReplayCommand, tells_the_score_of_an_exercise) {
  const std::string text = replayed("exercise_line.yaml");
  EXPECT_NE(text.find("\nmissed "), std::string::npos) << text;
}

}  // namespace
}  // namespace sectio::commands_test
