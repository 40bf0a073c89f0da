#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "sim_server/scene/yaml_value.h"
#include "tests/unit/commands/run_command.h"

namespace sectio::commands_test {
namespace {

namespace fs = std::filesystem;

const std::string kTriedScenes = SECTIO_SOURCE_DIR "/deploy/scenes/";

int run_try(const std::vector<std::string>& words) {
  return run_command("try", try_command, words);
}

std::string refusal_of_try(const std::vector<std::string>& words) {
  return refusal_of("try", try_command, words);
}

TEST(TryCommand, a_scene_without_a_motion_is_told_what_can_be_done) {
  const std::string scene = kTriedScenes + "auto_bar.yaml";
  EXPECT_EQ(refusal_of_try({scene}),
            scene +
                ": it has no tools, so every run would be the same: give a tool a `trace`, or play "
                "the scene once with --scene " +
                scene + " --offline");
}

TEST(TryCommand, flags_that_do_not_go_together_are_refused) {
  const std::string tried = kTriedScenes + "bar_volume_cut.yaml";
  EXPECT_EQ(refusal_of_try({tried, "--back-mm", "3"}), "--back-mm: needs --lifts, after which it is put down");
  EXPECT_EQ(refusal_of_try({tried, "--slower", "2", "--faster", "2"}), "--slower: expected without --faster");
}

TEST(TryCommand, a_directory_for_failures_that_can_not_be_made_is_told_before_the_runs) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(refusal_of_try({kTriedScenes + "bar_volume_cut.yaml", "--failures", "/proc/sectio"}),
            "--failures: /proc/sectio: can't be made: No such file or directory");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(TryCommand, a_failure_that_can_not_be_kept_ends_no_run) {
  const fs::path folder = fs::path(testing::TempDir()) / ("sectio_try_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::string scene = (folder / "scene.yaml").string();
  std::ofstream(scene) << yaml_with(kTriedScenes + "bar_volume_cut.yaml",
                                    {{"duration_s", "0.01"},
                                     {"bodies[0].mesh.file", SECTIO_SOURCE_DIR "/deploy/meshes/bar.obj"},
                                     {"tools[0].trace", SECTIO_SOURCE_DIR "/deploy/traces/bar_one_sequence.csv"}});
  std::ofstream(folder / "1") << "in the way\n";
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_try({scene, "--runs", "2", "--failures", folder.string()}), 1);
  const std::string text = testing::internal::GetCapturedStdout();
  EXPECT_NE(text.find(": 0 of 2, "), std::string::npos) << text;
  EXPECT_TRUE(fs::exists(folder / "2" / "scene.yaml"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace sectio::commands_test
