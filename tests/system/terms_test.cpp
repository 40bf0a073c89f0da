// Servers and bridges that have begun stay, and those that died are followed at once, whatever their clocks say.
#include "common/core/error.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Terms : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> own_server(const Flags& more = {}) const {
    Flags flags{"--scene", kScene, "--endless"};
    flags.insert(flags.end(), more.begin(), more.end());
    return program("sim_server", in_session(flags));
  }
  std::unique_ptr<Process> hand(const Flags& more = {}) const {
    Flags flags{"--trace", kTrace, "--wait-for-server"};
    flags.insert(flags.end(), more.begin(), more.end());
    return program("device_bridge", in_session(flags));
  }
  // The same program with a clock that is an hour behind.
  std::unique_ptr<Process> behind(const std::string& name, Flags flags) const {
    flags = in_session(std::move(flags));
    flags.insert(flags.begin(), {"LD_PRELOAD=" SECTIO_LATE_CLOCK, "SECTIO_CLOCK_BEHIND_S=3600",
                                 std::string(SECTIO_BIN_DIR "/") + name});
    return std::make_unique<Process>("/usr/bin/env", flags);
  }
  static constexpr const char* kForce = " ms, overruns: ";  // in a line of the bridge that has got a model
};

TEST_F(Terms, a_second_server_is_refused_though_its_clock_is_behind_and_the_first_goes_on) {
  const auto first = own_server();
  ASSERT_TRUE(first->wait_for("the session begins")) << first->output();
  ASSERT_TRUE(first->wait_for_next("step ")) << first->output();
  const auto second = behind("sim_server", {"--scene", kScene, "--endless"});
  EXPECT_EQ(second->exit_code(), kExitBadInput) << second->output();
  EXPECT_NE(second->output().find("another server has the body"), std::string::npos) << second->output();
  EXPECT_TRUE(first->wait_for_next("step ")) << first->output();
  first->send(SIGINT);
  EXPECT_EQ(first->exit_code(), 0) << first->output();
}

TEST_F(Terms, a_server_whose_clock_is_behind_follows_one_that_was_killed_and_viewers_go_on) {
  const auto first = own_server();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  first->send(SIGKILL);
  ASSERT_TRUE(first->exit_code());
  const auto second = behind("sim_server", {"--scene", kScene, "--steps", "3000"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
}

TEST_F(Terms, a_bridge_that_is_started_again_moves_its_instrument_though_its_clock_is_behind) {
  const auto server = own_server();
  auto first = hand();
  ASSERT_TRUE(first->wait_for(kForce)) << first->output();
  first->send(SIGKILL);
  ASSERT_TRUE(first->exit_code());
  const auto second = behind("device_bridge", {"--trace", kTrace, "--wait-for-server"});
  EXPECT_TRUE(second->wait_for(kForce)) << second->output();
  EXPECT_EQ(server->output().find("a second device bridge"), std::string::npos) << server->output();
}

TEST_F(Terms, a_second_bridge_is_not_heard_while_the_first_one_speaks) {
  const auto server = own_server({"--export", file("out")});
  const auto first = hand();
  ASSERT_TRUE(first->wait_for(kForce)) << first->output();
  const auto second = hand();
  EXPECT_TRUE(server->wait_for("a second device bridge moves tool 0: it is not heard")) << server->output();
}

TEST_F(Terms, an_instrument_for_which_nobody_speaks_is_withdrawn_and_its_cut_ends) {
  const auto server = own_server({"--export", file("out")});
  const auto first = hand();
  ASSERT_TRUE(first->wait_for("3.0 s, force")) << first->output();
  first->send(SIGKILL);
  EXPECT_TRUE(server->wait_for("is withdrawn from where it was")) << server->output();
  server->send(SIGINT);
  ASSERT_TRUE(server->exit_code()) << server->output();
  const auto events = json("out/report.json")["run"]["events"];
  EXPECT_EQ(events["instrument withdrawn"], 1) << events;
  EXPECT_GE(events.value("penetrated", 0), 1) << events;
  EXPECT_EQ(events.value("penetrated", 0), events.value("cut ended", 0)) << events;
}

}  // namespace
}  // namespace sectio
