// The real programs with what people and accidents do to them: wrong files and flags, kill -9, ^C, two at a time.
#include <algorithm>
#include <cctype>
#include <csignal>

#include "common/core/error.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Programs : public test::SessionPrograms {
 protected:
  // Ends at once with exit code 2 and one line in which both texts occur: the place and what is wrong with it.
  static void expect_bad_input(const std::string& name, const Flags& flags, const std::string& place,
                               const std::string& reason) {
    const auto process = program(name, flags);
    EXPECT_EQ(process->exit_code(), kExitBadInput) << process->output();
    const std::string& said = process->output();
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    EXPECT_EQ(said.rfind(name + ": error: ", 0), 0u) << said;
    EXPECT_NE(said.find(place), std::string::npos) << said << "does not name " << place;
    EXPECT_NE(said.find(reason), std::string::npos) << said << "does not say " << reason;
  }

  // The demonstration's scene with one thing changed, and its files still found. Returns its path.
  std::string changed_scene(const std::string& from, const std::string& to) const {
    std::string text = read_file(kScene);
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::logic_error("the scene has no " + from);
    text.replace(at, from.size(), to);
    const std::string deploy = SECTIO_SOURCE_DIR "/deploy/";
    for (std::size_t up = text.find("../"); up != std::string::npos; up = text.find("../")) text.replace(up, 3, deploy);
    write("scene.yaml", text);
    return file("scene.yaml");
  }
  // The value of a key of the scene, up to the end of its item.
  static std::string value_of(const std::string& key) {
    const std::string text = read_file(kScene);
    const std::size_t begin = text.find(key + ": ") + key.size() + 2;
    return text.substr(begin, text.find_first_of(",}\n", begin) - begin);
  }
  static std::string line_of(const std::string& path, const std::string& text) {
    const std::string all = read_file(path);
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(all.find(text));
    return path + ":" + std::to_string(1 + std::count(all.begin(), end, '\n')) + ":";
  }
  void refuse_scene(const std::string& from, const std::string& to, const std::string& reason) const {
    const std::string scene = changed_scene(from, to);
    expect_bad_input("sim_server", {"--scene", scene, "--offline"}, line_of(scene, to), reason);
  }

  std::unique_ptr<Process> free_server(Flags more) const {
    more.insert(more.begin(), {"--scene", kScene});
    return program("sim_server", in_session(more));
  }
};

// `sim_server 2>&1 | tee log` at a ^C, which ends both: nobody reads what the server still says.
TEST_F(Programs, a_session_outlives_the_reader_of_its_log) {
  const Flags flags = in_session({"--scene", kScene, "--play-traces", "--steps", "1500", "--export", file("out")});
  Flags all{"-c", "{ \"$0\" \"$@\"; echo $? >'" + file("code") + "'; } 2>&1 | head -n 1", SECTIO_BIN_DIR "/sim_server"};
  all.insert(all.end(), flags.begin(), flags.end());
  Process server("/bin/sh", all);
  EXPECT_EQ(server.exit_code(), 0) << server.output();
  EXPECT_EQ(read_file(file("code")), "1\n") << "its report could not be printed";
  EXPECT_EQ(json("out/report.json")["run"]["steps"], 1500);
}

TEST_F(Programs, a_number_out_of_range_is_refused_before_anything_is_written) {
  const Flags run{"--scene", kScene, "--offline", "--export", file("out")};
  const auto with = [](Flags flags, const Flags& more) {
    flags.insert(flags.end(), more.begin(), more.end());
    return flags;
  };
  expect_bad_input("sim_server", with(run, {"--steps", "99999999999999999999"}), "--steps", "expected a whole number");
  expect_bad_input("sim_server", with(run, {"--wait-for-viewers", "4294967296"}), "--wait-for-viewers", "4294967295");
  expect_bad_input("sim_server", with(run, {"--until-s", "-5"}), "--until-s", "expected >= 0");
  expect_bad_input("sim_server", {"replay", "a.mcap", "--from-s", "-5"}, "--from-s", "expected >= 0");
  expect_bad_input("render_client", {"--size", "4294968576x720"}, "--size", "expected WIDTHxHEIGHT");
  EXPECT_FALSE(std::filesystem::exists(file("out")));
}

TEST_F(Programs, a_scene_that_will_not_do_is_one_line_with_file_line_and_key) {
  expect_bad_input("sim_server", {"--scene", file("none.yaml"), "--offline"}, file("none.yaml"), "can't be read");
  refuse_scene("young_pa:", "youngs_pa:", "unknown key; did you mean young_pa?");
  refuse_scene("unit: " + value_of("unit"), "unit: inch", "expected one of m, cm, mm");
  refuse_scene("step_s: " + value_of("step_s"), "step_s: soon", "step_s");
  refuse_scene("young_pa: " + value_of("young_pa"), "young_pa: -5", "young_pa");
  refuse_scene("model: surface_springs", "model: jelly", "jelly");
}

TEST_F(Programs, C_EXP_3_a_running_session_is_tilted_and_its_journal_knows) {
  expect_bad_input("sim_server", {"tilt", "--gravity", "down"}, "--gravity", "expected x,y,z");
  expect_bad_input("sim_server", {"tilt", "--gravity", "0,0,-1000"}, "--gravity", "each from -100 to 100");
  expect_bad_input("sim_server", {"pause", "--patience-s", "0"}, "--patience-s", "expected > 0");
  const auto server = free_server({"--endless", "--export", file("out")});
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto tilt = program("sim_server", {"tilt", "--gravity", "4,0,-9", "--domain", std::to_string(network.domain),
                                           "--session", network.session, "--patience-s", "60"});
  EXPECT_EQ(tilt->exit_code(), 0) << tilt->output();
  EXPECT_NE(tilt->output().find("tilt: 1 server obeys"), std::string::npos) << tilt->output();
  server->send(SIGINT);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(json("out/report.json")["run"]["events"]["gravity turned"], 1);
  const auto replay = program("sim_server", {"replay", file("out/journal")});
  EXPECT_EQ(replay->exit_code(), 0);
  EXPECT_NE(replay->output().find("to [4, 0, -9] m/s2"), std::string::npos) << replay->output();
}

TEST_F(Programs, a_step_beyond_the_stable_one_is_refused_with_the_one_that_would_do) {
  expect_bad_input("sim_server",
                   {"--scene", changed_scene("young_pa: " + value_of("young_pa"), "young_pa: 1e8"), "--offline"},
                   "step_s", "the largest that would do");
}

TEST_F(Programs, a_damaged_mesh_is_one_line_with_file_and_place) {
  const std::string mesh = value_of("{file");
  const std::string whole = read_file(SECTIO_SOURCE_DIR "/deploy/scenes/" + mesh);
  write("half.obj", whole.substr(0, whole.rfind('\n', whole.size() - whole.size() / 10) + 1));
  refuse_scene("../meshes/" + std::filesystem::path(mesh).filename().string(), file("half.obj"), "not closed");
  write("not_a_mesh.obj", "once upon a time\n");
  refuse_scene("../meshes/" + std::filesystem::path(mesh).filename().string(), file("not_a_mesh.obj"),
               file("not_a_mesh.obj"));
  refuse_scene("../meshes/" + std::filesystem::path(mesh).filename().string(), file("none.obj"), file("none.obj"));
}

TEST_F(Programs, a_damaged_trace_is_one_line_with_file_and_line) {
  const std::string trace = read_file(kTrace);
  std::size_t seventh = 0;
  for (int line = 1; line < 7; ++line) seventh = trace.find('\n', seventh) + 1;
  const std::size_t field = trace.find(',', seventh) + 1;
  write("trace.csv", trace.substr(0, field) + "x" + trace.substr(field));
  expect_bad_input("device_bridge", {"--trace", file("trace.csv")}, file("trace.csv") + ":7:", "x_world_m");
  refuse_scene("../traces/liver_incision.csv", file("trace.csv"), file("trace.csv") + ":7:");
  expect_bad_input("device_bridge", {"--trace", file("none.csv")}, file("none.csv"), "can't be opened");
}

TEST_F(Programs, a_damaged_journal_is_one_line_with_file_and_byte) {
  ASSERT_EQ(
      program("sim_server", {"--scene", kScene, "--offline", "--steps", "1000", "--export", file("out")})->exit_code(),
      0);
  const std::string whole = read_file(file("out/journal"));
  write("short", whole.substr(0, whole.size() - 11));
  expect_bad_input("sim_server", {"replay", file("short")}, file("short") + ": byte ", "truncated");
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 0x10);
  write("flipped", flipped);
  expect_bad_input("sim_server", {"replay", file("flipped")}, file("flipped"), "");
  write("other", "not a journal\n");
  expect_bad_input("sim_server", {"replay", file("other")}, file("other"), "");
  expect_bad_input("sim_server", {"replay", file("none")}, file("none"), "can't be read");
  expect_bad_input("sim_server", {"replay", file("out/journal"), "--from-s", "1"}, "--from-s", "only DIRECTORY/inputs");
}

TEST_F(Programs, wrong_flags_are_one_line_that_names_them) {
  expect_bad_input("sim_server", {"--scene", kScene, "--nonsense"}, "--nonsense", "");
  expect_bad_input("sim_server", {"--nonsense"}, "--nonsense", "not expected");
  expect_bad_input("sim_server", {"rplay", "journal"}, "rplay", "unknown command");
  expect_bad_input("render_client", {"--nonsense"}, "--nonsense", "");
  expect_bad_input("device_bridge", {"--trace", kTrace, "--nonsense"}, "--nonsense", "");
  for (const char* name : {"sim_server", "render_client", "device_bridge"}) {
    const auto help = program(name, {"--help"});
    EXPECT_EQ(help->exit_code(), 0);
    EXPECT_NE(help->output().find("--domain"), std::string::npos);
  }
  expect_bad_input("sim_server", {}, "--scene", "required");
  expect_bad_input("sim_server", {"--scene", kScene, "--steps", "-5"}, "--steps", "a whole number from 0 ");
  expect_bad_input("sim_server", {"--scene", kScene, "--domain", "232"}, "--domain", "0 to 231");
  expect_bad_input("sim_server", {"--scene", kScene, "--session", "a*"}, "--session", "a*");
  expect_bad_input("sim_server", {"--scene", kScene, "--offline", "--export", "/proc/none"}, "/proc/none", "");
  expect_bad_input("device_bridge", {"--trace", kTrace, "--device", "wand"}, "--device", "wand");
  expect_bad_input("device_bridge", {"--trace", kTrace, "--log", "/none/log.csv"}, "/none/log.csv", "");
  expect_bad_input("draw_scenes", {"--scene", std::string(kScene) + "@0", file("a.png"), "--show-field", "glow"},
                   "--show-field", "there are none");
  expect_bad_input("draw_scenes", {"--scene", std::string(kScene) + "@0", file("a.png"), "--close-up", "-1"},
                   "--close-up", ">= 0");
  expect_bad_input("render_client", {"--size", "10"}, "--size", "WIDTHxHEIGHT");
  expect_bad_input("render_client", {"--camera-eye", "1,2"}, "--camera-eye", "x,y,z");
  expect_bad_input("render_client", {"--video", "/none/a.mp4"}, "/none/a.mp4", "");
  expect_bad_input("render_client", {"--report", "/none/report.json"}, "/none/report.json", "");
}

TEST_F(Programs, a_bridge_and_a_viewer_that_are_killed_stop_nobody) {
  auto sim = server({"--steps", "2500", "--export", file("out")}, 2);
  auto victim = viewer("victim", {"--no-pictures"});
  auto witness = viewer("witness", {"--no-pictures"});
  auto hand = bridge();
  ASSERT_TRUE(sim->wait_for("step 1")) << sim->output();
  ASSERT_TRUE(victim->wait_for("on the screen")) << victim->output();
  victim->send(SIGKILL);
  hand->send(SIGKILL);
  EXPECT_EQ(victim->exit_code(), 128 + SIGKILL);
  EXPECT_EQ(hand->exit_code(), 128 + SIGKILL);
  expect_equal_at_the_end(*witness);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_EQ(json("out/report.json")["run"]["steps"], 2500);
}

TEST_F(Programs, a_bridge_of_a_tool_that_the_scene_does_not_have_is_named) {
  const auto sim = free_server({"--endless"});
  ASSERT_TRUE(sim->wait_for("the session begins")) << sim->output();
  const auto hand = program("device_bridge", in_session({"--trace", kTrace, "--tool-id", "9"}));
  EXPECT_TRUE(sim->wait_for("warning: a device bridge moves tool 9; the scene has 1 tool, numbered from 0"))
      << sim->output();
  EXPECT_EQ(sim->output().find("18446744073709551615"), std::string::npos) << "an endless run has no last step";
}

TEST_F(Programs, a_bridge_that_slept_takes_its_place_again) {
  auto sim = server({"--endless"});
  auto screen = viewer("screen", {"--no-pictures"});
  auto hand = bridge();
  ASSERT_TRUE(hand->wait_for("servers: 1")) << hand->output();
  hand->send(SIGSTOP);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(sim->wait_for_next("simulated")) << sim->output();  // longer than the lease
  hand->send(SIGCONT);
  ASSERT_TRUE(hand->wait_for("was asleep")) << hand->output();
  EXPECT_TRUE(hand->wait_for_next("servers: 1")) << hand->output();
}

// The first bridge ends with its blade in the tissue. The second one counts its samples from 1 again.
TEST_F(Programs, a_bridge_that_is_started_again_is_followed_from_its_first_sample_on) {
  auto sim = server({"--endless", "--export", file("out")}, 0);
  for (int i = 0; i < 2; ++i) {
    const auto hand =
        program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server", "--duration-s", "1.6"}));
    EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  }
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_EQ(json("out/report.json")["run"]["events"]["penetrated"], 2);
}

TEST_F(Programs, a_terminal_that_is_closed_ends_each_in_order) {
  const auto as_it_was = std::signal(SIGHUP, SIG_DFL);  // nohup, where these tests run beneath it
  auto sim = server({"--endless", "--export", file("out")});
  auto screen = viewer("screen", {"--no-pictures"});
  auto hand = program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server", "--record", file("a.csv")}));
  std::signal(SIGHUP, as_it_was);
  ASSERT_TRUE(sim->wait_for("step 1")) << sim->output();
  ASSERT_TRUE(sim->wait_for_next("step ")) << sim->output();
  for (Process* each : {hand.get(), screen.get(), sim.get()}) {
    each->send(SIGHUP);
    EXPECT_EQ(each->exit_code(), 0) << each->output();
  }
  EXPECT_GT(json("out/report.json")["run"]["steps"], 0);
  EXPECT_GT(json("screen.json")["states_drawn"], 0);
}

TEST_F(Programs, interrupted_the_server_leaves_whole_files_and_says_goodbye) {
  auto sim = server({"--endless", "--export", file("out")});
  auto screen = viewer("screen", {"--no-pictures"});
  auto hand = bridge();
  ASSERT_TRUE(sim->wait_for("step 1")) << sim->output();
  ASSERT_TRUE(sim->wait_for_next("step ")) << sim->output();
  ASSERT_TRUE(sim->wait_for_next("step ")) << sim->output();
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();

  const nlohmann::json report = json("out/report.json"), body = report["bodies"][0];
  EXPECT_EQ(report["run"].at("edges_collapsed"), 0) << "a surface has none that could";
  EXPECT_TRUE(body["closed"].get<bool>());
  EXPECT_GT(body["revision"].get<int>(), 0);
  const auto replayed = program("sim_server", {"replay", file("out/journal")});
  EXPECT_EQ(replayed->exit_code(), 0) << replayed->output();
  EXPECT_NE(replayed->output().find(body["topology_hash"].get<std::string>()), std::string::npos) << replayed->output();
  const std::string obj = read_file(file("out/" + body["name"].get<std::string>() + ".obj"));
  std::size_t faces = 0;
  for (std::size_t at = obj.find("\nf "); at != std::string::npos; at = obj.find("\nf ", at + 1)) ++faces;
  EXPECT_EQ(faces, body["triangles"].get<std::size_t>());
}

TEST_F(Programs, a_server_that_is_killed_and_started_again_is_followed) {
  auto first = free_server({"--endless"});
  auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  first->send(SIGKILL);
  EXPECT_EQ(first->exit_code(), 128 + SIGKILL);
  auto second = free_server({"--steps", "1500", "--wait-for-viewers", "1", "--export", file("out")});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], json("out/report.json")["bodies"][0]["topology_hash"]);
}

TEST_F(Programs, two_sessions_of_one_domain_go_their_own_ways) {
  auto sim = server({"--steps", "1500", "--export", file("ours")});
  network.session += "-other";
  auto other = free_server({"--steps", "1500", "--wait-for-viewers", "1"});
  auto stranger = viewer("stranger", {"--no-pictures"});
  network.session.resize(network.session.size() - 6);
  auto screen = viewer("screen", {"--no-pictures"});
  auto hand = bridge();
  expect_equal_at_the_end(*screen);
  expect_equal_at_the_end(*stranger);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_EQ(other->exit_code(), 0) << other->output();
  EXPECT_EQ(json("screen.json")["session"], network.session);
  // Nobody's hand is in the other session: it stays as it was loaded.
  EXPECT_EQ(json("stranger.json")["bodies"][0]["revision"], 0);
}

// Traces that scenes of the project name can be made again.
TEST_F(Programs, traces_are_those_that_their_maker_writes) {
  std::filesystem::create_directories(file("traces"));
  const auto maker = program("make_traces", {file("traces")});
  ASSERT_EQ(maker->exit_code(), 0) << maker->output();
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(file("traces"))) {
    const std::string name = entry.path().filename();
    EXPECT_EQ(read_file(entry.path()), read_file(SECTIO_SOURCE_DIR "/deploy/traces/" + name)) << name;
    ++files;
  }
  EXPECT_GT(files, 10u);
}

}  // namespace
}  // namespace sectio
