#include <gtest/gtest.h>

#include "tests/unit/commands/run_command.h"

namespace sectio::commands_test {
namespace {

std::string refusal_of_run(std::vector<std::string> words) {
  words.insert(words.end(), {"--scene", SECTIO_SOURCE_DIR "/deploy/scenes/skin_cross.yaml", "--offline"});
  return refusal_of("run", sectio::run_command, std::move(words));
}

TEST(RunCommand, flags_of_a_session_on_the_network_are_refused_without_one) {
  for (const std::string flag : {"--endless", "--wait-for-tools", "--wait-for-bodies"})
    EXPECT_EQ(refusal_of_run({flag}), flag + ": it is of a session on the network, without --offline");
  EXPECT_EQ(refusal_of_run({"--wait-for-viewers", "2"}),
            "--wait-for-viewers: it is of a session on the network, without --offline");
  EXPECT_EQ(refusal_of_run({"--peer", "192.0.2.1"}), "--peer: it is of a session on the network, without --offline");
}

}  // namespace
}  // namespace sectio::commands_test
