// device_bridge by itself and in a session: which devices there are, and the record of a hand, which a scene can play.
#include <algorithm>

#include "common/math/trace.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

class Bridge : public test::SessionPrograms {
 protected:
  // The demonstration's scene with another trace.
  static std::string scene_with(const std::string& from, const std::string& to) {
    std::string text = scene_with_young("5400");
    return text.replace(text.find(from), from.size(), to);
  }
};

TEST_F(Bridge, lists_its_devices_and_says_which_there_are) {
  const auto list = program("device_bridge", {"--list-devices"});
  EXPECT_EQ(list->exit_code(), 0) << list->output();
  const std::string lines = list->output();
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 10) << lines;
  const auto wand = program("device_bridge", {"--trace", kTrace, "--device", "wand"});
  EXPECT_NE(wand->exit_code(), 0);
  for (const std::string& name :
       std::vector<std::string>{"scripted", "virtual_hand", "wish", "haply", "force_dimension", "open_haptics",
                                "tracker", "gamepad", "spacemouse", "mouse"}) {
    EXPECT_NE(("\n" + lines).find("\n" + name + " "), std::string::npos) << lines;
    EXPECT_NE(wand->output().find(name), std::string::npos) << wand->output();
  }
}

TEST_F(Bridge, a_file_that_can_not_be_written_is_one_line) {
  write("other.csv", "kept");
  for (const std::string& path : {std::string("/none/hand.csv"), std::string(kTrace), file("other.csv")}) {
    const auto hand = program("device_bridge", {"--trace", kTrace, "--record", path, "--log", file("./other.csv")});
    EXPECT_NE(hand->exit_code(), 0);
    EXPECT_EQ(std::ranges::count(hand->output(), '\n'), 1) << hand->output();
    EXPECT_NE(hand->output().find("--record: " + path), std::string::npos) << hand->output();
  }
  EXPECT_EQ(std::filesystem::file_size(file("other.csv")), 4U);
}

TEST_F(Bridge, what_a_hand_did_is_a_trace_that_a_scene_plays) {
  auto sim = server({"--endless"}, 0);
  const auto hand =
      program("device_bridge", in_session({"--trace", kTrace, "--device", "virtual_hand", "--wait-for-server",
                                           "--record", file("hand.csv"), "--log", file("log.csv")}));
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  const std::vector<TracePoint> moved = load_trace(file("hand.csv")), wish = load_trace(kTrace);
  EXPECT_EQ(moved, load_trace(file("log.csv")));
  EXPECT_NEAR(moved.back().time_s, wish.back().time_s, 0.1);
  for (const TracePoint& point : moved)
    ASSERT_LT((point.pose_world.position_m - pose_at(wish, point.time_s).position_m).norm(), 0.02);

  write("scene.yaml", scene_with(SECTIO_SOURCE_DIR "/deploy/traces/liver_incision.csv", file("hand.csv")));
  const auto played = program("sim_server", {"--scene", file("scene.yaml"), "--offline", "--export", file("played")});
  EXPECT_EQ(played->exit_code(), 0) << played->output();
  EXPECT_EQ(json("played/report.json")["run"]["events"]["penetrated"], 1);
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
}

// At 1 mm/s the blade doesn't come down to the liver in the time of the run.
TEST_F(Bridge, an_instrument_is_no_faster_than_its_scene_says_unless_the_flag_says_else) {
  write("scene.yaml", scene_with("    kind: scalpel", "    kind: scalpel\n    max_speed_m_per_s: 0.001"));
  for (const bool flag : {false, true}) {
    std::vector<std::string> flags{"--scene", file("scene.yaml"), "--wait-for-tools", "--steps",
                                   "1800",    "--export",         file("out")};
    if (flag) flags.insert(flags.end(), {"--max-speed-m-per-s", "5"});
    const auto sim = program("sim_server", in_session(flags));
    const auto hand = bridge();
    EXPECT_EQ(sim->exit_code(), 0) << sim->output();
    EXPECT_EQ(hand->exit_code(), 0) << hand->output();
    EXPECT_EQ(json("out/report.json")["run"]["events"].value("penetrated", 0), flag ? 1 : 0);
  }
  const auto wrong = program("sim_server", {"--scene", kScene, "--max-speed-m-per-s", "-1"});
  EXPECT_EQ(wrong->exit_code(), 2) << wrong->output();
}

TEST_F(Bridge, a_disk_that_is_full_stops_no_session) {
  auto sim = server({"--endless"}, 0);
  const auto hand =
      program("device_bridge",
              in_session({"--trace", kTrace, "--wait-for-server", "--duration-s", "0.5", "--record", "/dev/full"}));
  EXPECT_EQ(hand->exit_code(), 1) << hand->output();
  EXPECT_NE(hand->output().find("warning: --record: /dev/full: the disk takes no more"), std::string::npos)
      << hand->output();
  EXPECT_NE(hand->output().find("error: --record: /dev/full"), std::string::npos) << hand->output();
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
}

}  // namespace
}  // namespace sectio
