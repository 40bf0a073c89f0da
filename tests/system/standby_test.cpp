// A standby follows the server of a session when that one dies, at any moment, and nobody notices more than a pause.
#include <filesystem>
#include <sstream>

#include "common/dds/endpoints.h"
#include "common/messages/epoch.h"
#include "tests/support/environment.h"
#include "tests/support/random.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;
using Clock = std::chrono::steady_clock;

class Standby : public test::SessionPrograms {};

// A scene whose server says nothing more.
SceneInfo mute_scene(const std::string& session) {
  SceneInfo scene;
  scene.epoch = new_epoch({7});
  scene.session = session;
  scene.world_bodies = {"liver"};
  scene.bodies = {{"liver"}};
  return scene;
}

TEST_F(Standby, takes_part_in_every_step_and_ends_with_the_session) {
  const auto second = one("second", {"--standby", "--play-traces"});
  ASSERT_TRUE(second->wait_for("standing by")) << second->output();
  const auto first = one("first", {"--play-traces", "--steps", "1500"});
  EXPECT_EQ(first->exit_code(), 0) << first->output();
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(second->output().find("fell silent"), std::string::npos) << second->output();
  EXPECT_EQ(hash_of("second"), hash_of("first"));
  EXPECT_EQ(json("second/report.json")["run"]["steps"], json("first/report.json")["run"]["steps"]);
}

TEST_F(Standby, that_comes_late_begins_with_the_last_checkpoint_of_its_server) {
  const auto first = one("first", {"--play-traces"});
  const auto kept = [&] {
    std::error_code error;
    for (const auto& each : std::filesystem::directory_iterator(file("first/checkpoints"), error))
      if (each.path().extension() != ".part") return true;
    return false;
  };
  while (!kept()) let_pass(std::chrono::milliseconds(10));
  const auto second = program(
      "sim_server", in_session({"--standby", "--play-traces", "--resume", file("first"), "--export", file("second")}));
  ASSERT_TRUE(second->wait_for("from the checkpoint of step ")) << second->output();
  ASSERT_TRUE(second->wait_for("it has caught up with the server")) << second->output();
  first->send(SIGKILL);
  EXPECT_TRUE(first->exit_code());
  EXPECT_TRUE(second->wait_for("the server fell silent: this one goes on after step ")) << second->output();
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second"), undisturbed_hash());
}

// The dead server may have kept steps that no standby got; here it has gone on by itself.
TEST_F(Standby, that_begins_in_the_directory_of_a_dead_server_goes_back_to_where_the_next_one_parted_from_it) {
  const auto first = one("first", {"--play-traces", "--wait-for-viewers", "1", "--endless"});
  const auto second = one("second", {"--play-traces", "--standby", "--endless"});
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(second->wait_for("it has caught up with the server")) << second->output();
  first->send(SIGKILL);
  EXPECT_TRUE(first->exit_code());
  const auto apart = program("sim_server", {"--resume", file("first"), "--domain", std::to_string(network.domain),
                                            "--session", network.session + "_apart"});
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(apart->wait_for_next("step ")) << apart->output();
  apart->send(SIGKILL);
  EXPECT_TRUE(apart->exit_code());
  ASSERT_TRUE(second->wait_for("the server fell silent: this one goes on after step ")) << second->output();
  const auto third = program("sim_server", in_session({"--standby", "--play-traces", "--endless", "--resume",
                                                       file("first"), "--export", file("third")}));
  EXPECT_TRUE(third->wait_for("its past isn't that of the server: this one goes back to step ")) << third->output();
  EXPECT_TRUE(third->wait_for("it has caught up with the server")) << third->output();
  second->send(SIGINT);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(third->exit_code(), 0) << third->output();
  EXPECT_EQ(hash_of("third/try_2"), hash_of("second"));
}

// Kills the leader at random moments of the session: SECTIO_DEATHS of them, a few by default.
TEST_F(Standby, follows_a_server_that_is_killed_or_halted_at_any_moment_and_ends_as_if_nothing_had_happened) {
  const int deaths = static_cast<int>(test::number_from("SECTIO_DEATHS", 3));
  const std::string expected = undisturbed_hash();
  test::Random random(static_cast<unsigned>(network.domain));
  int equal = 0, same_hash = 0, stood_down = 0, halted = 0;
  std::vector<double> pauses_s;
  for (int i = 0; i < deaths; ++i) {
    const bool halt = i % 2 == 1;
    const std::string run = std::to_string(i);
    const auto first = one("first" + run, {"--play-traces", "--wait-for-viewers", "1"});
    const auto second = one("second" + run, {"--play-traces", "--standby"});
    ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
    const auto screen = viewer("screen" + run, {"--no-pictures"});
    ASSERT_TRUE(second->wait_for("step ")) << second->output() << first->output() << screen->output();
    let_pass(std::chrono::milliseconds(random() % 5000));
    first->send(halt ? SIGSTOP : SIGKILL);
    EXPECT_TRUE(second->wait_for("the server fell silent: this one goes on after step ")) << second->output();
    if (halt) {
      let_pass(std::chrono::milliseconds(random() % 1500));
      first->send(SIGCONT);
      ++halted;
      const auto code = first->exit_code();
      stood_down += code == 1 && first->output().find("this one stands down") != std::string::npos;
      if (code != 1) ADD_FAILURE() << first->output();
    }
    expect_equal_at_the_end(*screen);
    equal += screen->output().find("equals server: yes") != std::string::npos;
    EXPECT_EQ(second->exit_code(), 0) << second->output();
    same_hash += hash_of("second" + run) == expected;
    pauses_s.push_back(json("screen" + run + ".json").value("max_state_gap_s", -1.0));
  }
  std::ostringstream rates;
  rates << "deaths " << deaths << ", viewers equal " << equal << ", hash as without " << same_hash << ", halted "
        << halted << ", of them stood down " << stood_down << ", longest pauses of states, s:";
  std::sort(pauses_s.begin(), pauses_s.end());
  for (const double pause_s : pauses_s) rates << ' ' << pause_s;
  std::puts(rates.str().c_str());
  EXPECT_EQ(equal, deaths);
  EXPECT_EQ(same_hash, deaths);
  EXPECT_EQ(stood_down, halted);
}

// The network's thread lives on; a server that says so of a simulation that hangs would hold its standby back for ever.
TEST_F(Standby, follows_a_server_whose_simulation_hangs) {
  const auto first =
      one("first", {"--play-traces", "--wait-for-viewers", "1", "--stall-at-s", "1.5", "--stall-s", "4"});
  const auto second = one("second", {"--play-traces", "--standby"});
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto screen = viewer("screen", {"--no-pictures"});
  EXPECT_TRUE(second->wait_for("the server fell silent: this one goes on after step ")) << second->output();
  EXPECT_EQ(first->exit_code(), 1) << first->output();
  EXPECT_NE(first->output().find("this one stands down"), std::string::npos) << first->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second"), undisturbed_hash());
}

// Nobody speaks to it any more, which is what a cut of its own link looks like.
TEST_F(Standby, that_hears_nobody_any_more_waits_and_stands_by_again) {
  const auto second = one("second", {"--standby", "--endless"});
  ASSERT_TRUE(second->wait_for("standing by")) << second->output();
  const auto first = one("first", {"--endless"});
  const auto hand = program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server"}));
  ASSERT_TRUE(hand->wait_for("1.0 s, force")) << hand->output();
  ASSERT_TRUE(second->wait_for("it has caught up with the server")) << second->output();
  for (const auto* each : {&hand, &first}) (*each)->send(SIGSTOP);
  ASSERT_TRUE(second->wait_for("it waits until somebody speaks")) << second->output();
  for (const auto* each : {&hand, &first}) (*each)->send(SIGCONT);
  ASSERT_TRUE(second->wait_for_next("step ")) << second->output();
  EXPECT_TRUE(hand->exit_code()) << hand->output();
  first->send(SIGINT);
  EXPECT_EQ(first->exit_code(), 0) << first->output();
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(second->output().find("fell silent"), std::string::npos) << second->output();
}

// A pause isn't a hang.
TEST_F(Standby, stands_by_while_its_server_pauses) {
  const auto first = one("first", {"--play-traces", "--steps", "2500", "--wait-for-viewers", "1"});
  const auto second = one("second", {"--play-traces", "--standby"});
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(first->wait_for("step ")) << first->output();
  EXPECT_EQ(program("sim_server", in_session({"pause", "--patience-s", "60"}))->exit_code(), 0);
  let_pass(std::chrono::milliseconds(3500));
  EXPECT_EQ(program("sim_server", in_session({"go-on", "--patience-s", "60"}))->exit_code(), 0);
  EXPECT_EQ(first->exit_code(), 0) << first->output();
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(second->output().find("fell silent"), std::string::npos) << second->output();
}

// Fast DDS may leave two programs that know of each other in one direction alone. Here is a server that never sends
// inputs: its standby joins the session anew, and ends when the server does.
TEST_F(Standby, that_hears_no_inputs_joins_anew_and_does_not_outlive_the_session) {
  Endpoints<Reads<>, Writes<SceneInfo, SessionEnd>> server(network, kServerName);
  const SceneInfo scene = mute_scene(network.session);
  ASSERT_TRUE(server.write(scene));
  const auto second = one("second", {"--standby"});
  EXPECT_TRUE(second->wait_for("hears nothing of the server for which it stands by: joining the session anew"))
      << second->output();
  EXPECT_TRUE(server.write(SessionEnd{scene.epoch, 0, "complete", {{}}}));
  EXPECT_EQ(second->exit_code(), 1) << second->output();
  EXPECT_NE(second->output().find("the session ended before this standby had heard a step of it"), std::string::npos)
      << second->output();
}

TEST_F(Standby, that_was_there_before_a_dead_server_stands_by_for_the_next_one) {
  const auto second = one("second", {"--standby", "--play-traces"});
  ASSERT_TRUE(second->wait_for("standing by")) << second->output();
  {
    Endpoints<Reads<>, Writes<SceneInfo>> server(network, kServerName);
    ASSERT_TRUE(server.write(mute_scene(network.session)));
    EXPECT_TRUE(second->wait_for("joining the session anew")) << second->output();
  }
  const auto first = one("first", {"--play-traces", "--steps", "300"});
  EXPECT_EQ(first->exit_code(), 0) << first->output();
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second"), hash_of("first"));
}

// Two servers have an organ each; the one of the kidney dies, and its standby follows.
TEST_F(Standby, of_a_server_with_a_share_of_the_bodies_takes_over_that_share) {
  const Flags organs{"--scene", SECTIO_SOURCE_DIR "/deploy/scenes/two_organs.yaml", "--play-traces"};
  const auto share = [&](const std::string& name, Flags more) {
    more.insert(more.end(), organs.begin(), organs.end());
    more.insert(more.end(), {"--export", file(name)});
    return program("sim_server", in_session(more));
  };
  const auto second = share("second", {"--server", "right", "--standby"});
  ASSERT_TRUE(second->wait_for("standing by")) << second->output();
  const auto left = share("left", {"--server", "left", "--wait-for-bodies", "--wait-for-viewers", "1"});
  const auto right = share("right", {"--server", "right", "--wait-for-bodies", "--wait-for-viewers", "1"});
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(second->wait_for("step ")) << second->output();
  let_pass(std::chrono::milliseconds(2500));
  right->send(SIGKILL);
  expect_equal_at_the_end(*screen);
  EXPECT_TRUE(left->exit_code()) << left->output();
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  const auto offline = program("sim_server", {"--scene", organs[1], "--offline", "--export", file("whole")});
  EXPECT_EQ(offline->exit_code(), 0) << offline->output();
  EXPECT_EQ(hash_of("second"), json("whole/report.json")["bodies"][1]["topology_hash"]);
  EXPECT_EQ(hash_of("left"), hash_of("whole"));
}

TEST_F(Standby, that_joins_late_catches_up_by_the_inputs_that_the_server_has_kept) {
  const auto first = one("first", {"--play-traces", "--wait-for-viewers", "1"});
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(first->wait_for("1.")) << first->output();
  ASSERT_TRUE(first->wait_for_next("step ")) << first->output();
  const auto second = one("second", {"--play-traces", "--standby"});
  ASSERT_TRUE(second->wait_for("it has caught up")) << second->output();
  first->send(SIGKILL);
  EXPECT_TRUE(second->wait_for("this one goes on after step ")) << second->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second"), undisturbed_hash());
}

TEST_F(Standby, that_comes_into_a_pause_takes_over_paused_and_with_the_same_tools_frozen) {
  const auto give = [&](const Flags& order) {
    const auto told = program("sim_server", in_session(order));
    EXPECT_EQ(told->exit_code(), 0) << told->output();
    return told->output();
  };
  const auto first = one("first", {"--endless"});
  ASSERT_TRUE(first->wait_for("step ")) << first->output();
  give({"freeze", "--tool-id", "0", "--patience-s", "60"});
  give({"pause", "--patience-s", "60"});
  const auto second = one("second", {"--endless", "--standby"});
  ASSERT_TRUE(second->wait_for("it has caught up")) << second->output();
  EXPECT_TRUE(second->wait_for(", which is paused")) << second->output();
  first->send(SIGKILL);
  ASSERT_TRUE(second->wait_for("this one goes on after step ")) << second->output();
  const std::string status = give({"status", "--patience-s", "60"});
  EXPECT_NE(status.find("s simulated, paused"), std::string::npos) << status;
  EXPECT_NE(status.find("tool 0 is frozen"), std::string::npos) << status;
  give({"go-on", "--patience-s", "60"});
  second->send(SIGINT);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
}

TEST_F(Standby, that_has_another_scene_says_at_which_step_it_differs_and_leaves) {
  const auto first = one("first", {"--play-traces", "--endless"});
  ASSERT_TRUE(first->wait_for("the session begins")) << first->output();
  write("other.yaml", scene_with_young("15400"));
  const auto second = program("sim_server", in_session({"--scene", file("other.yaml"), "--standby"}));
  EXPECT_EQ(second->exit_code(), 1) << second->output();
  EXPECT_NE(second->output().find("from that of the server: this is no standby for it"), std::string::npos)
      << second->output();
}

TEST_F(Standby, of_a_scene_that_looks_otherwise_says_so_and_leaves) {
  const auto first = one("first", {"--play-traces", "--endless"});
  ASSERT_TRUE(first->wait_for("the session begins")) << first->output();
  std::string text = scene_with_young("5400");
  const std::string view = "field_of_view_deg: 28";
  ASSERT_NE(text.find(view), std::string::npos);
  text.replace(text.find(view), view.size(), "field_of_view_deg: 40");
  write("other.yaml", text);
  const auto second = program("sim_server", in_session({"--scene", file("other.yaml"), "--standby"}));
  EXPECT_EQ(second->exit_code(), kExitBadInput) << second->output();
  EXPECT_NE(second->output().find("the server runs another scene"), std::string::npos) << second->output();
}

TEST_F(Standby, of_other_bodies_says_that_it_waits_for_another_server) {
  Endpoints<Reads<>, Writes<SceneInfo, SessionEnd>> server(network, kServerName);
  SceneInfo scene = mute_scene(network.session);
  scene.world_bodies = {"kidney"};
  scene.bodies = {{"kidney"}};
  ASSERT_TRUE(server.write(scene));
  const auto second = one("second", {"--standby"});
  EXPECT_TRUE(second->wait_for("the session's server has other bodies, and this one can't stand by for it"))
      << second->output();
  second->send(SIGINT);
  second->exit_code();
}

// The hand's force over the death of the server, from the bridge's own log.
TEST_F(Standby, hands_the_instrument_over_without_a_jolt) {
  const auto second = one("second", {"--standby", "--endless"});
  ASSERT_TRUE(second->wait_for("standing by")) << second->output();
  const auto first = one("first", {"--endless"});
  const auto screen = viewer("screen", {"--no-pictures"});
  const auto hand = program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server", "--device",
                                                         "virtual_hand", "--log", file("hand.csv")}));
  ASSERT_TRUE(hand->wait_for("3.0 s, force")) << hand->output();
  first->send(SIGKILL);
  EXPECT_TRUE(second->wait_for("this one goes on after step ")) << second->output();
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  second->send(SIGINT);
  EXPECT_TRUE(second->exit_code()) << second->output();
  expect_equal_at_the_end(*screen);

  std::ifstream log(file("hand.csv"));
  std::string line;
  std::getline(log, line);
  std::vector<std::string> names;
  std::istringstream header(line);
  for (std::string name; std::getline(header, name, ',');) names.push_back(name);
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  struct Tick {
    double age_s, force_n, change_n;
  };
  std::vector<Tick> ticks;
  std::vector<double> before;
  while (std::getline(log, line)) {
    std::vector<double> values;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');) values.push_back(std::atof(field.c_str()));
    if (values.size() < names.size()) continue;
    double change = 0, force = 0;
    for (const char* axis : {"force_x_world_n", "force_y_world_n", "force_z_world_n"}) {
      force += values[column(axis)] * values[column(axis)];
      if (!before.empty()) change += std::pow(values[column(axis)] - before[column(axis)], 2);
    }
    ticks.push_back({values[column("model_age_s")], std::sqrt(force), std::sqrt(change)});
    before = values;
  }
  // From where models cease to half a second after they have come again, against all the time before.
  const auto ceased = std::find_if(ticks.begin() + std::min<std::ptrdiff_t>(2500, std::ssize(ticks)), ticks.end(),
                                   [](const Tick& tick) { return tick.age_s > 0.08; });
  ASSERT_NE(ceased, ticks.end()) << "the server was not missed: nothing was tried";
  const auto begin = ceased - 100, end = ceased + std::min<std::ptrdiff_t>(600, ticks.end() - ceased);
  double usual_n = 0, steepest_n = 0, most_n = 0;
  for (auto tick = ticks.begin(); tick != begin; ++tick) usual_n = std::max(usual_n, tick->change_n);
  for (auto tick = begin; tick != end; ++tick) {
    steepest_n = std::max(steepest_n, tick->change_n);
    most_n = std::max(most_n, tick->force_n);
  }
  std::printf("force: steepest %.3f N a tick, %.3f N before; most %.2f N\n", steepest_n, usual_n, most_n);
  EXPECT_GT(most_n, 0.1);
  EXPECT_LT(steepest_n, std::max(0.2, 1.2 * usual_n));
  EXPECT_LT(ticks.back().age_s, 0.08) << "the hand feels the one that followed";
}

}  // namespace
}  // namespace sectio
