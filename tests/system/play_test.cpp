// Records of servers and of viewers, shown from any moment on.
#include <filesystem>

#include "common/core/error.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Play : public test::SessionPrograms {
 protected:
  // A session that is over, with the records of its server and of viewers.
  std::string recorded(Flags more = {}) const {
    more.insert(more.end(), {"--scene", kScene, "--play-traces", "--record", file("server.mcap"), "--export",
                             file("out"), "--wait-for-viewers", "1"});
    const auto server = program("sim_server", in_session(more));
    const auto early = viewer("early", {"--no-pictures", "--record", file("early.mcap")});
    do EXPECT_TRUE(server->wait_for_next(" cuts")) << server->output();
    while (server->output().ends_with(" 0 cuts\n"));  // the knife is in the tissue
    const auto late = viewer("late", {"--no-pictures", "--record", file("late.mcap")});
    expect_equal_at_the_end(*early);
    expect_equal_at_the_end(*late);
    EXPECT_EQ(server->exit_code(), 0) << server->output();
    return json("out/report.json")["bodies"][0]["topology_hash"];
  }
  std::unique_ptr<Process> play(const std::string& record, Flags more = {}) const {
    more.insert(more.begin(), {"play", file(record), "--wait-for-viewers", "1"});
    return program("sim_server", in_session(more));
  }
  void give(const std::string& command, Flags more = {}) const {
    more.insert(more.begin(), {command, "--domain", std::to_string(network.domain), "--session", network.session,
                               "--patience-s", "60"});
    const auto order = program("sim_server", more);
    EXPECT_EQ(order->exit_code(), 0) << order->output();
    EXPECT_NE(order->output().find(command + ": 1 server obeys"), std::string::npos) << order->output();
  }
  double shown_s() const {
    const auto asked = program("sim_server", in_session({"status"}));
    EXPECT_EQ(asked->exit_code(), 0) << asked->output();
    const std::string text = asked->output().substr(0, asked->output().find(" s simulated"));
    return std::stod(text.substr(text.find_last_of(" ") + 1));
  }
};

TEST_F(Play, shows_what_viewers_have_recorded_also_one_that_came_late) {
  const std::string hash = recorded();
  for (const char* record : {"server.mcap", "early.mcap", "late.mcap"}) {
    const auto server = play(record, {"--speed", "4"});
    const auto screen = viewer("screen", {"--no-pictures"});
    expect_equal_at_the_end(*screen);
    EXPECT_EQ(server->exit_code(), 0) << record << ": " << server->output();
    EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], hash) << record;
    EXPECT_GT(json("screen.json")["frames_drawn"], 10) << record;
  }
  const auto replay = program("sim_server", {"replay", file("late.mcap")});
  EXPECT_EQ(replay->exit_code(), kExitBadInput) << replay->output();
  EXPECT_NE(replay->output().find("late.mcap: a record without the inputs"), std::string::npos) << replay->output();
}

TEST_F(Play, goes_to_any_moment_of_a_record_and_ends_as_it_did) {
  const std::string hash = recorded();
  const auto server = play("server.mcap", {"--from-s", "6.2", "--speed", "0.01"});
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  EXPECT_GE(shown_s(), 6.1);
  give("pause");
  give("seek", {"--to-s", "0.5"});  // before the first cut, and paused
  EXPECT_NEAR(shown_s(), 0.5, 0.1);
  give("seek", {"--to-s", "3"});
  EXPECT_NEAR(shown_s(), 3, 0.1);
  const auto score = program("sim_server", in_session({"score", "--patience-s", "60"}));
  EXPECT_NE(score->exit_code(), 0) << score->output();
  EXPECT_NE(score->output().find("a record is shown, not scored"), std::string::npos) << score->output();
  give("go-on");
  give("seek", {"--to-s", "1e9"});
  EXPECT_TRUE(server->wait_for("paused at the end of the record")) << server->output();
  give("seek", {"--to-s", "3"});
  EXPECT_NEAR(shown_s(), 3, 0.1) << "nobody has lost the session";
  give("speed", {"--factor", "10"});
  give("go-on");
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], hash);
}

TEST_F(Play, goes_to_any_moment_of_a_journal_of_inputs) {
  const auto offline = program("sim_server", {"--scene", kScene, "--offline", "--export", file("out")});
  ASSERT_EQ(offline->exit_code(), 0) << offline->output();
  const auto server = play("out/inputs", {"--from-s", "6.2", "--speed", "0.01"});
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  give("seek", {"--to-s", "2"});
  give("speed", {"--factor", "10"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], json("out/report.json")["bodies"][0]["topology_hash"]);
}

TEST_F(Play, refuses_what_shows_nothing_in_a_line) {
  write("empty.mcap", "\x89MCAP0\r\n");
  for (const char* name : {"empty.mcap", "none.mcap"}) {
    const auto server = play(name);
    EXPECT_EQ(server->exit_code(), kExitBadInput) << server->output();
    EXPECT_NE(server->output().find(file(name) + ": "), std::string::npos) << server->output();
  }
  const auto screen = viewer("screen", {"--no-pictures", "--record", file("none/a.mcap")});
  EXPECT_EQ(screen->exit_code(), kExitBadInput) << screen->output();
  EXPECT_NE(screen->output().find(file("none/a.mcap") + ": "), std::string::npos) << screen->output();
}

}  // namespace
}  // namespace sectio
