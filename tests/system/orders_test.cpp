// Orders of the person who leads a session: pause, another speed, begin anew, tell the score.
#include "common/core/error.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Orders : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> ask(const std::string& command, Flags more = {}) const {
    more.insert(more.begin(), {command, "--domain", std::to_string(network.domain), "--session", network.session,
                               "--patience-s", "60"});
    return program("sim_server", more);
  }
  void give(const std::string& command, const Flags& more = {}) const {
    const auto order = ask(command, more);
    EXPECT_EQ(order->exit_code(), 0) << order->output();
    EXPECT_NE(order->output().find(command + ": 1 server obeys"), std::string::npos) << order->output();
  }
  // It begins with its first viewer, and exports to `out`.
  std::unique_ptr<Process> watched_server() const {
    return program("sim_server", in_session({"--scene", kScene, "--play-traces", "--wait-for-viewers", "1", "--export",
                                             file("out")}));
  }
  std::string status() const {
    const auto asked = ask("status");
    EXPECT_EQ(asked->exit_code(), 0) << asked->output();
    return asked->output();
  }
  static std::string time_of(const std::string& status) { return status.substr(0, status.find(" s simulated")); }
};

TEST_F(Orders, a_paused_session_stands_still_serves_a_late_viewer_and_goes_on_at_the_speed_that_it_is_told) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--endless"}));
  ASSERT_TRUE(server->wait_for(" cuts")) << server->output();
  give("pause");
  const std::string paused = status();
  EXPECT_NE(paused.find("s simulated, paused"), std::string::npos) << paused;
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("session '" + network.session + "'")) << screen->output();
  EXPECT_EQ(time_of(status()), time_of(paused));
  give("speed", {"--factor", "4"});
  give("go-on");
  EXPECT_NE(status().find("at 4 times the clock"), std::string::npos);
  EXPECT_NE(time_of(status()), time_of(paused));
  server->send(SIGINT);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  expect_equal_at_the_end(*screen);
}

TEST_F(Orders, a_frozen_instrument_is_told_of_and_one_that_is_not_there_is_refused) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--endless"}));
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  give("freeze", {"--tool-id", "0"});
  EXPECT_NE(status().find("tool 0 is frozen"), std::string::npos) << status();
  const auto order = ask("freeze", {"--tool-id", "3"});
  EXPECT_EQ(order->exit_code(), 2) << order->output();
  EXPECT_NE(order->output().find("freeze: --tool-id: the scene has 1 instrument, numbered from 0, got 3"),
            std::string::npos)
      << order->output();
  give("thaw", {"--tool-id", "0"});
  EXPECT_EQ(status().find("is frozen"), std::string::npos);
}

// Each time it has another epoch, of the same program.
TEST_F(Orders, a_session_is_begun_anew_as_often_as_people_like_and_whoever_stays_goes_on) {
  const auto server = watched_server();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(server->wait_for(" cuts")) << server->output();
  for (int i = 0; i < 9; ++i) give("anew");
  do ASSERT_TRUE(server->wait_for_next(" cuts")) << server->output();
  while (cuts_told_by(*server) == 0);
  server->send(SIGINT);
  EXPECT_TRUE(server->exit_code()) << server->output();
  expect_equal_at_the_end(*screen);
  EXPECT_GT(json("screen.json")["bodies"][0]["revision"], 0);
}

TEST_F(Orders, a_session_that_is_begun_anew_ends_like_the_first_and_keeps_the_first_try) {
  const auto server = watched_server();
  const auto screen = viewer("screen", {"--no-pictures"});
  do ASSERT_TRUE(server->wait_for_next(" cuts")) << server->output();
  while (cuts_told_by(*server) == 0);
  give("anew");
  const auto another = program("sim_server", in_session({"--scene", kScene, "--export", file("out")}));
  EXPECT_EQ(another->exit_code(), kExitBadInput) << another->output();
  EXPECT_NE(another->output().find("another run writes there"), std::string::npos) << another->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_GT(json("out/report.json")["bodies"][0]["revision"], 0) << "the first try";
  EXPECT_EQ(hash_of("out/try_2"), undisturbed_hash());
}

TEST_F(Orders, a_session_that_can_not_begin_anew_stays_where_it_is_and_says_why) {
  const auto server = watched_server();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(server->wait_for("step ")) << server->output();
  write("out/try_2", "in the way");
  const auto anew = ask("anew");
  EXPECT_EQ(anew->exit_code(), kExitBadInput) << anew->output();
  const std::string why = "it stays where it is: " + file("out/try_2") + ": can't be made: Not a directory";
  EXPECT_NE(anew->output().find("anew: refused by the server of liver: " + why), std::string::npos) << anew->output();
  EXPECT_TRUE(server->wait_for("warning: anew: " + why)) << server->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(hash_of("out"), undisturbed_hash());
}

TEST_F(Orders, an_instrument_that_nobody_holds_is_not_frozen) {
  const auto refused = [&](const std::string& why) {
    const auto freeze = ask("freeze", {"--tool-id", "0"});
    EXPECT_EQ(freeze->exit_code(), kExitBadInput) << freeze->output();
    EXPECT_NE(freeze->output().find("freeze: refused by the server of liver: " + why), std::string::npos)
        << freeze->output();
  };
  auto server = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--endless", "--export",
                                                  file("out"), "--record", file("a.mcap")}));
  ASSERT_TRUE(server->wait_for("step ")) << server->output();
  refused("instruments follow the scene's traces");
  server->send(SIGINT);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  for (const char* past : {"out/inputs", "a.mcap"}) {
    server = program("sim_server", in_session({"play", file(past), "--speed", "0.01"}));
    ASSERT_TRUE(server->wait_for(" on domain ")) << server->output();
    refused("what is played again is as it was");
    server->send(SIGINT);
    EXPECT_EQ(server->exit_code(), 0) << server->output();
  }
}

// Steps that are run again are those of the first try, and the traces go on from there: the end is that of a session
// in which nobody went back.
TEST_F(Orders, a_session_that_goes_back_in_time_ends_as_if_it_had_not_and_keeps_both_tries) {
  const auto server = watched_server();
  const auto screen = viewer("screen", {"--no-pictures"});
  const auto steps = [&] {
    const std::string& said = server->output();
    const std::size_t at = said.rfind("step ");
    return at == std::string::npos ? 0 : std::stoi(said.substr(at + 5));
  };
  do ASSERT_TRUE(server->wait_for_next("step ")) << server->output();
  while (steps() < 1500);
  const auto ahead = ask("seek", {"--to-s", "1000"});
  EXPECT_EQ(ahead->exit_code(), kExitBadInput) << ahead->output();
  EXPECT_NE(ahead->output().find("seek: refused by the server of liver: it stays where it is: nobody knows what comes"),
            std::string::npos)
      << ahead->output();
  const auto back = ask("seek", {"--to-s", "1.2"});
  EXPECT_EQ(back->exit_code(), 0) << back->output();
  EXPECT_NE(back->output().find("the session goes on from 1.20 s"), std::string::npos) << back->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(hash_of("out/try_2"), undisturbed_hash());
  EXPECT_LT(json("out/report.json")["run"]["steps"], json("out/try_2/report.json")["run"]["steps"]);
}

TEST_F(Orders, a_session_that_is_begun_anew_in_a_pause_is_seen_at_its_beginning) {
  const auto server = watched_server();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(server->wait_for(" cuts")) << server->output();
  give("pause");
  give("anew");
  EXPECT_NE(status().find("0.0 s simulated, paused"), std::string::npos) << status();
  const auto late = viewer("late", {"--no-pictures"});
  ASSERT_TRUE(late->wait_for("on the screen")) << late->output();
  give("go-on");
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  expect_equal_at_the_end(*screen);
  expect_equal_at_the_end(*late);
}

TEST_F(Orders, a_server_that_is_resumed_goes_on_with_the_last_try_paused_and_frozen_as_it_was) {
  auto server = program("sim_server", in_session({"--scene", kScene, "--endless", "--export", file("out")}));
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  give("anew");
  ASSERT_TRUE(server->wait_for("the session begins anew")) << server->output();
  give("freeze", {"--tool-id", "0"});
  give("speed", {"--factor", "0.5"});
  give("pause");
  const std::string before = time_of(status());
  server->send(SIGKILL);
  EXPECT_TRUE(server->exit_code().has_value());
  const auto kept = std::filesystem::file_size(file("out/inputs"));
  server = program("sim_server", in_session({"--resume", file("out"), "--endless"}));
  ASSERT_TRUE(server->wait_for("the session goes on")) << server->output();
  const std::string after = status();
  EXPECT_EQ(time_of(after), before) << after;
  EXPECT_NE(after.find("paused"), std::string::npos) << after;
  EXPECT_NE(after.find("tool 0 is frozen"), std::string::npos) << after;
  const auto late = viewer("late", {"--no-pictures"});
  ASSERT_TRUE(late->wait_for("on the screen")) << late->output();
  give("go-on");
  EXPECT_NE(status().find("at 0.5 times the clock"), std::string::npos) << status();
  give("speed", {"--factor", "10"});
  give("anew");
  ASSERT_TRUE(server->wait_for_next(" s simulated")) << server->output();
  server->send(SIGINT);
  EXPECT_TRUE(server->exit_code().has_value()) << server->output();  // nobody cut what the scene expects
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(std::filesystem::file_size(file("out/inputs")), kept);
  EXPECT_TRUE(std::filesystem::exists(file("out/try_2/report.json")));
  EXPECT_TRUE(std::filesystem::exists(file("out/try_3/report.json")));
}

TEST_F(Orders, an_order_that_nobody_can_obey_is_refused_in_a_line) {
  const auto fast = ask("speed", {"--factor", "1000"});
  EXPECT_EQ(fast->exit_code(), kExitBadInput) << fast->output();
  EXPECT_NE(fast->output().find("--factor: expected 0.01 to 10, got 1000"), std::string::npos) << fast->output();
  const auto server = program("sim_server", in_session({"--scene", kScene, "--endless"}));
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto back = ask("seek", {"--to-s", "0"});
  EXPECT_EQ(back->exit_code(), kExitBadInput) << back->output();
  EXPECT_NE(back->output().find("it stays where it is: the session keeps no inputs"), std::string::npos)
      << back->output();
  const auto score = ask("score");
  EXPECT_EQ(score->exit_code(), 0) << score->output();
  EXPECT_NE(score->output().find("no exercise"), std::string::npos) << score->output();
}

}  // namespace
}  // namespace sectio
