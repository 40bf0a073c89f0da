#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/offline_run.h"
#include "tests/unit/commands/run_command.h"

namespace sectio::commands_test {
namespace {

TEST(ReplayCommand, takes_the_inputs_in_the_directory_of_an_export) {
  const std::string folder = testing::TempDir() + "/sectio_replay_" + std::to_string(::getpid());
  const std::string file = SECTIO_SOURCE_DIR "/deploy/scenes/bar_volume_falls.yaml";
  ASSERT_EQ(run_offline(prepared(load_scene(file, standard_traits())), 5, folder).report.empty(), false);
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_command("replay", replay_command, {folder}), 0);
  const std::string text = testing::internal::GetCapturedStdout();
  EXPECT_EQ(text.substr(0, 8), "5 steps\n");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace sectio::commands_test
