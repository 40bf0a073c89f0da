// The real programs: the bodies of one scene divided over several servers on loopback.
#include <algorithm>
#include <sstream>

#include "common/core/error.h"
#include "tests/support/gateway_programs.h"
#include "tests/support/patience.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

// Two organs of a few thousand triangles, and the scalpels of the scene that is delivered.
constexpr const char* kTwoOrgans = R"(session: two_organs
duration_s: 3.2
bodies:
  - name: liver
    server: left
    mesh: {file: DEPLOY/meshes/liver_2k.obj, unit: m}
    material: {young_pa: 5400, skin_thickness_m: 0.004, foundation_radius_m: 0.03, pretension: 0.3}
    cutting: {threshold_force_n: 0.1}
    fixed: {min_world_m: [-0.2, -0.2, -0.2], max_world_m: [0.2, 0.2, -0.018]}
  - name: kidney
    server: right
    mesh: {file: DEPLOY/meshes/kidney_2k.obj, unit: m}
    pose: {position_world_m: [0.145, 0, 0]}
    material: {young_pa: 8000, foundation_radius_m: 0.03, pretension: 0.15}
    cutting: {threshold_force_n: 0.03}
    fixed: {min_world_m: [-0.2, -0.2, -0.2], max_world_m: [0.4, 0.2, -0.008]}
tools:
  - {name: liver_scalpel, kind: scalpel, trace: DEPLOY/traces/liver_incision.csv}
  - {name: kidney_scalpel, kind: scalpel, trace: DEPLOY/traces/organs_kidney.csv}
)";

class Divided : public test::GatewayPrograms {
 protected:
  Divided() {
    std::string text = kTwoOrgans;
    const std::string deploy = SECTIO_SOURCE_DIR "/deploy";
    for (std::size_t at = text.find("DEPLOY"); at != std::string::npos; at = text.find("DEPLOY"))
      text.replace(at, 6, deploy);
    write("organs.yaml", text);
  }

  std::unique_ptr<Process> share(Flags more) const {
    more.insert(more.begin(), {"--scene", file("organs.yaml")});
    return program("sim_server", in_session(more));
  }
};

TEST_F(Divided, A_ARCH_11_two_servers_give_the_hashes_of_one_and_viewers_see_one_world) {
  const Flags both{"--wait-for-viewers", "1", "--wait-for-bodies", "--play-traces"};
  const auto with = [&](Flags flags) {
    flags.insert(flags.end(), both.begin(), both.end());
    return flags;
  };
  auto left = share(with({"--server", "left", "--export", file("left")}));
  EXPECT_TRUE(left->wait_for("waiting for servers of kidney")) << left->output();
  auto screen = viewer("screen", {"--no-pictures"});
  auto right = share(with({"--bodies", "kidney", "--export", file("right")}));
  ASSERT_TRUE(left->wait_for_next("step ")) << left->output();
  auto late = viewer("late", {"--no-pictures"});
  expect_equal_at_the_end(*screen);
  expect_equal_at_the_end(*late);
  EXPECT_EQ(left->exit_code(), 0) << left->output();
  EXPECT_EQ(right->exit_code(), 0) << right->output();

  auto one = share({"--offline", "--export", file("one")});
  EXPECT_EQ(one->exit_code(), 0) << one->output();
  const nlohmann::json whole = json("one/report.json");
  ASSERT_EQ(whole["bodies"].size(), 2u);
  EXPECT_GT(whole["bodies"][0]["revision"].get<int>(), 0);
  EXPECT_GT(whole["bodies"][1]["revision"].get<int>(), 0);
  for (const char* report : {"screen.json", "late.json"}) {
    const nlohmann::json seen = json(report);
    EXPECT_EQ(seen["servers"], 2);
    ASSERT_EQ(seen["bodies"].size(), 2u) << seen;
    for (std::size_t b = 0; b < 2; ++b) {
      EXPECT_EQ(seen["bodies"][b]["name"], whole["bodies"][b]["name"]);
      EXPECT_EQ(seen["bodies"][b]["topology_hash"], whole["bodies"][b]["topology_hash"]);
    }
  }
  EXPECT_EQ(json("left/report.json")["bodies"].size(), 1u);
  EXPECT_EQ(json("left/report.json")["bodies"][0]["topology_hash"], whole["bodies"][0]["topology_hash"]);
  EXPECT_EQ(json("right/report.json")["bodies"][0]["topology_hash"], whole["bodies"][1]["topology_hash"]);
}

TEST_F(Divided, a_second_server_for_a_body_is_refused_with_one_line_and_disturbs_nobody) {
  auto first = share({"--server", "left", "--endless"});
  auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  EXPECT_EQ(program("sim_server", in_session({"status", "--body", "liver"}))->exit_code(), 0);
  const auto status = program("sim_server", in_session({"status", "--body", "kidney", "--patience-s", "2"}));
  EXPECT_EQ(status->exit_code(), kExitBadInput) << status->output();
  EXPECT_NE(status->output().find("no server has a body 'kidney'"), std::string::npos) << status->output();
  auto second = share({"--bodies", "kidney,liver", "--endless"});
  EXPECT_EQ(second->exit_code(), kExitBadInput) << second->output();
  EXPECT_NE(second->output().find("error: session '" + network.session + "': another server has the body 'liver'"),
            std::string::npos)
      << second->output();
  ASSERT_TRUE(first->wait_for_next("step ")) << first->output();
  first->send(SIGINT);
  EXPECT_EQ(first->exit_code(), 0) << first->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(json("screen.json")["bodies"].size(), 1u);
}

// The clock of the others doesn't stand still meanwhile.
TEST_F(Divided, a_server_that_comes_late_catches_up_and_holds_nobody) {
  auto left = share({"--server", "left", "--play-traces", "--wait-for-viewers", "1", "--export", file("left")});
  auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(left->wait_for("the session begins")) << left->output();
  for (int s = 0; s < 2; ++s) ASSERT_TRUE(left->wait_for_next("simulated")) << left->output();
  auto right = share({"--server", "right", "--play-traces", "--export", file("right")});
  EXPECT_EQ(left->exit_code(), 0) << left->output();
  EXPECT_EQ(right->exit_code(), 0) << right->output();
  expect_equal_at_the_end(*screen);
  EXPECT_LT(json("left/report.json")["session_cost"]["waited_for_servers_s"].get<double>(), 0.5);
  auto one = share({"--offline", "--export", file("one")});
  EXPECT_EQ(one->exit_code(), 0) << one->output();
  const nlohmann::json whole = json("one/report.json");
  EXPECT_EQ(json("left/report.json")["bodies"][0]["topology_hash"], whole["bodies"][0]["topology_hash"]);
  EXPECT_EQ(json("right/report.json")["bodies"][0]["topology_hash"], whole["bodies"][1]["topology_hash"]);
}

TEST_F(Divided, a_hand_reaches_the_server_that_has_the_organ_it_touches) {
  auto left = share({"--server", "left", "--endless", "--export", file("left")});
  auto right = share({"--server", "right", "--endless", "--export", file("right")});
  ASSERT_TRUE(left->wait_for("the session begins")) << left->output();
  ASSERT_TRUE(right->wait_for("the session begins")) << right->output();
  auto hand = program("device_bridge",
                      in_session({"--trace", SECTIO_SOURCE_DIR "/deploy/traces/organs_kidney.csv", "--tool-id", "1",
                                  "--wait-for-server", "--duration-s", "2.5", "--log", file("hand.csv")}));
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  for (Process* server : {left.get(), right.get()}) server->send(SIGINT);
  EXPECT_EQ(left->exit_code(), 0) << left->output();
  EXPECT_EQ(right->exit_code(), 0) << right->output();
  EXPECT_EQ(json("left/report.json")["bodies"][0]["revision"], 0);
  EXPECT_GT(json("right/report.json")["bodies"][0]["revision"], 0);
  // And it feels the kidney, though the server of the liver answers as often that there is nothing.
  std::ifstream log(file("hand.csv"));
  std::string line;
  std::getline(log, line);
  const auto commas_before = [&] {
    const std::size_t at = line.find("force_z_world_n");
    return at == std::string::npos ? -1 : std::count(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(at), ',');
  };
  const auto column = commas_before();
  ASSERT_GE(column, 0) << line;
  double most_n = 0;
  while (std::getline(log, line)) {
    std::istringstream fields(line);
    std::string field;
    for (auto i = column; i >= 0; --i) std::getline(fields, field, ',');
    most_n = std::max(most_n, std::abs(std::stod(field)));
  }
  EXPECT_GT(most_n, 0.02);
}

TEST_F(Divided, A_ARCH_6_A_ARCH_12_what_is_done_about_a_stall_is_logged_and_what_copies_cost_is_reported) {
  auto server = share({"--wait-for-viewers", "1", "--steps", "1000", "--stall-at-s", "0.4", "--stall-s", "0.12",
                       "--export", file("out")});
  auto screen = viewer("screen", {"--no-pictures"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_TRUE(server->output().find("reduced: ") != std::string::npos ||
              server->output().find("slowed: ") != std::string::npos)
      << server->output();
  const nlohmann::json report = json("out/report.json"), cost = report["session_cost"], seen = json("screen.json");
  EXPECT_GT(cost["reduced_steps"].get<int>() + cost["slowed_steps"].get<int>(), 0);
  EXPECT_GE(cost["most_behind_s"].get<double>(), 0.11);
  EXPECT_GE(report["run"]["events"]["step overrun"].get<int>(), 1);
  EXPECT_GT(cost["publish_time_total_s"].get<double>(), 0);
  EXPECT_GT(cost["network_time_total_s"].get<double>(), 0);
  EXPECT_GT(seen["total_sync_time_s"].get<double>(), 0);
  // Rest positions, corners, neighbours and positions in each copy: some 100 bytes a triangle.
  std::size_t triangles = 0;
  for (const auto& body : report["bodies"]) triangles += body["triangles"].get<std::size_t>();
  for (const std::size_t bytes : {cost["copy_bytes"].get<std::size_t>(), seen["copy_bytes"].get<std::size_t>()}) {
    EXPECT_GT(bytes, 40 * triangles);
    EXPECT_LT(bytes, 400 * triangles);
  }
}

TEST_F(Divided, an_order_says_which_server_refuses_it_and_which_obeys) {
  const auto left = share({"--server", "left", "--play-traces", "--endless", "--export", file("left")});
  const auto right = share({"--server", "right", "--play-traces", "--endless"});
  for (Process* each : {left.get(), right.get()}) ASSERT_TRUE(each->wait_for("step ")) << each->output();
  const auto seek = program("sim_server", in_session({"seek", "--to-s", "0", "--patience-s", "60"}));
  EXPECT_EQ(seek->exit_code(), kExitBadInput) << seek->output();
  EXPECT_NE(seek->output().find("seek: refused by the server of kidney: it stays where it is: the session keeps no "
                                "inputs to go back by (--export); the server of liver obeys"),
            std::string::npos)
      << seek->output();
  for (Process* each : {left.get(), right.get()}) {
    each->send(SIGINT);
    EXPECT_TRUE(each->exit_code()) << each->output();
  }
}

// Idle hands and pages belong to the session, not to the server that spoke to them last.
TEST_F(Divided, the_session_ends_with_its_last_server_for_idle_hands_and_pages_too) {
  const auto left = share({"--server", "left", "--endless"});
  const auto right = share({"--server", "right", "--endless"});
  const auto hand = program("device_bridge", in_session({"--device", "wish", "--wait-for-server"}));
  const auto pages = gateway();
  for (const auto* server : {&left, &right}) ASSERT_TRUE((*server)->wait_for("step ")) << (*server)->output();
  ASSERT_TRUE(pages->wait_for("/#")) << pages->output();
  const auto are_here = [&] {
    const auto status = program("sim_server", in_session({"status"}));
    const bool answered = status->exit_code() == 0;
    const auto tells = [&](const char* kind) { return status->output().find(kind) != std::string::npos; };
    return answered && tells("\nhand ") && tells("\nviewer ");
  };
  EXPECT_TRUE(test::wait_until(are_here));
  right->send(SIGTERM);
  EXPECT_EQ(right->exit_code(), 0) << right->output();
  for (int s = 0; s < 2; ++s) EXPECT_TRUE(left->wait_for_next("step ")) << left->output();
  EXPECT_TRUE(test::wait_until(are_here));
  EXPECT_EQ(hand->output().find("the session has ended"), std::string::npos) << hand->output();
  EXPECT_EQ(pages->output().find("the session has ended"), std::string::npos) << pages->output();
  left->send(SIGTERM);
  EXPECT_EQ(left->exit_code(), 0) << left->output();
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  EXPECT_EQ(pages->exit_code(), 0) << pages->output();
}

TEST_F(Divided, a_viewer_does_not_wait_for_the_end_of_a_server_that_has_died) {
  const auto left = share({"--server", "left", "--play-traces", "--wait-for-bodies", "--wait-for-viewers", "1"});
  const auto right = share({"--server", "right", "--play-traces", "--wait-for-bodies", "--wait-for-viewers", "1"});
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(right->wait_for("step ")) << right->output();
  right->send(SIGKILL);
  EXPECT_EQ(left->exit_code(), 0) << left->output();
  EXPECT_EQ(screen->exit_code(), 1) << screen->output();
  EXPECT_NE(screen->output().find("the server of kidney fell silent and the others have ended"), std::string::npos)
      << screen->output();
}

}  // namespace
}  // namespace sectio
