// Programs that are started without --session, without a server, or with what the scene doesn't have.
#include "common/core/error.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Sessions : public test::SessionPrograms {
 protected:
  Flags in_domain(Flags flags) const {
    flags.insert(flags.end(), {"--domain", std::to_string(network.domain)});
    return flags;
  }
  std::unique_ptr<Process> server_of(const std::string& session) const {
    auto process =
        program("sim_server", in_domain({"--scene", kScene, "--endless", "--session", network.session + session}));
    EXPECT_TRUE(process->wait_for("the session begins")) << process->output();
    return process;
  }
};

TEST_F(Sessions, the_only_one_of_a_domain_is_found_by_every_program) {
  const auto server = server_of("");
  const auto screen = program("render_client", in_domain({"--no-pictures"}));
  EXPECT_TRUE(screen->wait_for("session '" + network.session + "' on the screen")) << screen->output();
  const auto hand =
      program("device_bridge", in_domain({"--trace", kTrace, "--duration-s", "0.5", "--wait-for-server"}));
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  const auto status = program("sim_server", Flags{"status", "--domain", std::to_string(network.domain)});
  EXPECT_EQ(status->exit_code(), 0) << status->output();
  EXPECT_NE(status->output().find("liver"), std::string::npos) << status->output();
  EXPECT_NE(status->output().find(", 1 viewers"), std::string::npos) << "it isn't one itself: " << status->output();
}

TEST_F(Sessions, of_several_in_a_domain_one_must_be_named) {
  const auto one = server_of("-a"), two = server_of("-b");
  for (const Flags& flags : {Flags{"render_client", "--no-pictures"}, Flags{"device_bridge", "--trace", kTrace}}) {
    const auto lost = program(flags[0], in_domain({flags.begin() + 1, flags.end()}));
    EXPECT_EQ(lost->exit_code(), kExitBadInput) << lost->output();
    EXPECT_NE(lost->output().find("expected one of " + network.session + "-a, " + network.session + "-b"),
              std::string::npos)
        << lost->output();
  }
}

TEST_F(Sessions, without_a_server_every_program_says_so_and_fails) {
  const auto screen = viewer("screen", {"--no-pictures", "--duration-s", "1"});
  EXPECT_EQ(screen->exit_code(), 1);
  EXPECT_NE(screen->output().find("was met"), std::string::npos) << screen->output();
  const auto hand = program("device_bridge", in_session({"--trace", kTrace, "--duration-s", "0.3"}));
  EXPECT_EQ(hand->exit_code(), 1);
  EXPECT_NE(hand->output().find("was met"), std::string::npos) << hand->output();
  const auto anywhere = program("render_client", in_domain({"--no-pictures", "--duration-s", "1"}));
  EXPECT_EQ(anywhere->exit_code(), kExitBadInput);
  EXPECT_NE(anywhere->output().find("no server was found on domain"), std::string::npos) << anywhere->output();
}

TEST_F(Sessions, a_tool_that_the_scene_does_not_have_is_named_on_both_sides) {
  const auto server = server_of("");
  const auto hand = program(
      "device_bridge", in_session({"--trace", kTrace, "--duration-s", "1", "--wait-for-server", "--tool-id", "7"}));
  EXPECT_TRUE(hand->wait_for("the scene has no tool 7; it has 0 ")) << hand->output();
  EXPECT_EQ(hand->exit_code(), 1);
  EXPECT_TRUE(server->wait_for("a device bridge moves tool 7; the scene has 1 tool")) << server->output();
}

TEST_F(Sessions, an_interface_that_this_machine_does_not_have_is_refused) {
  for (const Flags& flags : {Flags{"render_client", "--no-pictures"}, Flags{"device_bridge", "--trace", kTrace},
                             Flags{"sim_server", "--scene", kScene}}) {
    Flags more(flags.begin() + 1, flags.end());
    more.insert(more.end(), {"--interface", "203.0.113.7"});
    const auto process = program(flags[0], in_session(more));
    EXPECT_EQ(process->exit_code(), kExitBadInput) << process->output();
    EXPECT_NE(process->output().find("--interface: no interface of this machine has the address 203.0.113.7"),
              std::string::npos)
        << process->output();
  }
}

TEST_F(Sessions, a_server_that_slept_is_seen_again) {
  const auto server = server_of("");
  const auto screen = viewer("screen", {"--no-pictures", "--duration-s", "20"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  server->send(SIGSTOP);
  // Nobody hears of it now; that this is so for longer than its lease is asked of a clock.
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(4);
  while (std::chrono::steady_clock::now() < until) screen->wait_for("never said", std::chrono::seconds(1));
  server->send(SIGCONT);
  ASSERT_TRUE(server->wait_for("was asleep: joining the session anew")) << server->output();
  const auto late = viewer("late", {"--no-pictures"});
  EXPECT_TRUE(late->wait_for("on the screen")) << late->output();
  server->send(SIGINT);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(server->output().find("speaks in its server's name"), std::string::npos) << "it heard itself";
  expect_equal_at_the_end(*screen);
  expect_equal_at_the_end(*late);
}

}  // namespace
}  // namespace sectio
