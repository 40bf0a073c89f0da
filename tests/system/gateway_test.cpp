// The gateway as a process, without a browser.
#include <turbojpeg.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "tests/support/gateway_programs.h"
#include "tests/support/http.h"
#include "tests/support/web_peer.h"

namespace sectio {
namespace {

using test::http_get;
using test::HttpAnswer;
using test::Process;
using test::WebPeer;

class GatewayProgram : public test::GatewayPrograms {};

// The share of a picture's pixels that look like tissue; nothing when it is none.
std::optional<double> tissue_share(const std::string& jpeg, int& width_px, int& height_px) {
  const std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), tjDestroy);
  const auto* bytes = reinterpret_cast<const unsigned char*>(jpeg.data());
  int sampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder.get(), bytes, jpeg.size(), &width_px, &height_px, &sampling, &colours)) return {};
  std::vector<unsigned char> rgb(3 * static_cast<std::size_t>(width_px * height_px));
  if (tjDecompress2(decoder.get(), bytes, jpeg.size(), rgb.data(), width_px, 0, height_px, TJPF_RGB, 0)) return {};
  double red = 0;
  for (std::size_t i = 0; i < rgb.size(); i += 3) red += rgb[i] > 60 && rgb[i] > 1.6 * rgb[i + 1] ? 1 : 0;
  return 3 * red / static_cast<double>(rgb.size());
}

TEST_F(GatewayProgram, draws_for_those_who_can_not) {
  const auto sim = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--endless"}));
  const auto web = gateway();
  const int port = port_of(*web);
  for (int i = 0; i < 3; ++i) {
    const HttpAnswer answer = http_get(port, "/frame.jpg?" + std::to_string(i));
    EXPECT_EQ(answer.status, 200) << answer.head;
    EXPECT_NE(answer.head.find("image/jpeg"), std::string::npos) << answer.head;
    int width_px = 0, height_px = 0;
    const std::optional<double> share = tissue_share(answer.body, width_px, height_px);
    ASSERT_TRUE(share) << answer.body.size();
    EXPECT_EQ(width_px, 960);
    EXPECT_EQ(height_px, 540);
    EXPECT_GT(*share, 0.2);
    EXPECT_LT(*share, 0.95);
  }
  EXPECT_NE(http_get(port, "/metrics").body.find("sectio_gateway_clients 0\n"), std::string::npos)
      << "whoever draws is nobody";
  EXPECT_EQ(http_get(port, "/none.jpg").status, 404);
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_EQ(web->exit_code(), 0) << web->output();
}

// A person whose browser wishes leads a probe onto the liver, and presses; what the hand did is a trace.
TEST_F(GatewayProgram, what_a_person_at_a_page_did_is_a_trace_that_a_scene_plays) {
  constexpr char kProbe[] = SECTIO_SOURCE_DIR "/deploy/scenes/probe_liver.yaml";
  const auto sim = program("sim_server", in_session({"--scene", kProbe, "--endless"}));
  const auto web = gateway();
  const std::string port = std::to_string(port_of(*web));
  const auto hand = program("device_bridge", in_session({"--device", "wish", "--record", file("hand.csv")}));
  const auto person = program("watchers", {"--port", port, "--token", "theatre", "--wishes", "2"});
  EXPECT_EQ(person->exit_code(), 0) << person->output();
  EXPECT_NE(person->output().find("| a force that has changed by 20 mN | "), std::string::npos) << person->output();
  const auto others = program("watchers", {"--port", port, "--watchers", "5", "--seconds", "1"});
  EXPECT_EQ(others->exit_code(), 0) << others->output();
  EXPECT_NE(others->output().find("| 5 | "), std::string::npos) << others->output();
  for (Process* each : {hand.get(), sim.get()}) {
    each->send(SIGINT);
    EXPECT_EQ(each->exit_code(), 0) << each->output();
  }
  std::ifstream scene(kProbe);
  std::string text{std::istreambuf_iterator<char>(scene), {}};
  const std::size_t trace = text.find("trace: "), end = text.find_first_of("\n,}", trace);
  text.replace(trace, end - trace, "trace: " + file("hand.csv"));
  text.replace(text.find("duration_s: 4.8"), 15, "duration_s: 60");
  for (std::size_t at = text.find("../"); at != std::string::npos; at = text.find("../", at))
    text.replace(at, 3, SECTIO_SOURCE_DIR "/deploy/");
  write("scene.yaml", text);
  const auto played = program("sim_server", {"--scene", file("scene.yaml"), "--offline", "--export", file("played")});
  EXPECT_EQ(played->exit_code(), 0) << played->output();
  EXPECT_GT(json("played/report.json")["run"]["contact_time_s"], 0.5);
}

constexpr char kTwoScalpels[] = SECTIO_SOURCE_DIR "/deploy/scenes/skin_two.yaml";

// A person whose browser wishes one scalpel to a place.
struct Surgeon {
  WebPeer peer;
  std::uint32_t tool;
  Vec3 place_m;

  Surgeon(int port, const std::string& name, std::uint32_t own_tool)
      : peer(port, {name, "theatre"}), tool(own_tool), place_m(0.05 * own_tool, 0, 0.06) {
    EXPECT_TRUE(peer.wait_until([&] { return peer.own_id() != kNobody && peer.scene; }));
    peer.say(LiveKind::claim, ToolClaim{tool, ClaimAction::claim});
    EXPECT_TRUE(peer.wait_until([&] { return peer.holder(tool) == peer.own_id(); }));
  }
  double distance_m() const {
    const bool there = peer.state && tool < peer.state->tools.size() && peer.state->tools[tool].present;
    return there ? (peer.state->tools[tool].pose_world.position_m - place_m).norm() : 1e9;
  }
  bool leads() {
    return peer.wait_until([&] { return distance_m() < 0.001; }, [&] { peer.wish(tool, place_m); });
  }
  // Goes on wishing until it holds.
  bool waits_for(const std::function<bool()>& condition) {
    return peer.wait_until(condition, [&] { peer.wish(tool, place_m); });
  }
};

TEST_F(GatewayProgram, who_only_watches_may_stay_as_long_as_pings_are_answered) {
  const auto sim = program("sim_server", in_session({"--scene", kScene, "--endless"}));
  const auto web = gateway();
  WebPeer eve(port_of(*web), {"Eve", ""});
  EXPECT_TRUE(eve.wait_until([&] { return eve.pings == 4; })) << eve.goodbye;
  sim->send(SIGINT);
  EXPECT_EQ(web->exit_code(), 0) << web->output();
}

// Half a kilobyte for each state that another browser sees: what waits on the way takes longer than a ping may.
TEST_F(GatewayProgram, who_reads_slowly_may_stay) {
  const auto sim = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--endless"}));
  const auto web = gateway();
  const int port = port_of(*web);
  WebPeer ben(port, {"Ben", ""}), eve(port, {"Eve", ""});
  bool is_there = true;
  std::size_t seen = 0;
  const auto read_a_little = [&] {
    for (; seen < ben.states; ++seen) is_there = eve.read_little(512);
  };
  EXPECT_TRUE(ben.wait_until([&] { return ben.pings == 5 || !is_there; }, read_a_little));
  EXPECT_TRUE(is_there) << eve.goodbye;
  sim->send(SIGINT);
  EXPECT_EQ(web->exit_code(), 0) << web->output();
}

TEST_F(GatewayProgram, two_people_hold_an_instrument_each_and_one_whose_link_stops_loses_it) {
  const auto sim = program("sim_server", in_session({"--scene", kTwoScalpels, "--endless"}));
  const auto left = program("device_bridge", in_session({"--device", "wish", "--tool-id", "0"}));
  const auto right = program("device_bridge", in_session({"--device", "wish", "--tool-id", "1"}));
  const auto web = gateway();
  const int port = port_of(*web);
  Surgeon ada(port, "Ada", 0), ben(port, "Ben", 1);
  EXPECT_TRUE(ada.leads());
  EXPECT_TRUE(ben.leads());
  EXPECT_TRUE(ada.leads());

  ben.peer.say(LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  for (int i = 0; i < 50; ++i) ben.peer.wish(0, Vec3(1, 1, 1));
  EXPECT_TRUE(ben.waits_for([&] { return ben.peer.was_told("is held by Ada"); }));
  EXPECT_NE(http_get(port, "/metrics").body.find("refused_not_holder_total 50\n"), std::string::npos);
  const std::size_t seen = ada.peer.states;
  EXPECT_TRUE(ada.waits_for([&] { return ada.peer.states > seen + 10 || ada.distance_m() > 0.001; }));
  EXPECT_LT(ada.distance_m(), 0.001) << "only she moves it";

  // From here on Ben's socket stays open, and says and reads nothing.
  const auto is_there = [&](std::size_t tool) { return ada.peer.state->tools[tool].present; };
  ASSERT_TRUE(is_there(1));
  EXPECT_TRUE(ada.waits_for([&] { return !is_there(1); })) << "his scalpel is withdrawn";
  EXPECT_TRUE(ada.waits_for([&] { return ada.peer.holder(1) == kNobody; }));
  EXPECT_TRUE(ada.peer.was_told("was taken from Ben, whose hand was silent for 3 s"));
  EXPECT_LT(ada.distance_m(), 0.001);
  Surgeon cat(port, "Cat", 1);
  EXPECT_TRUE(cat.leads());
  const auto knows_ben = [&] {
    return std::ranges::any_of(cat.peer.roster.people, [](const Person& p) { return p.name == "Ben"; });
  };
  EXPECT_TRUE(knows_ben());
  EXPECT_TRUE(cat.waits_for([&] { return !knows_ben(); }));
  EXPECT_TRUE(web->wait_for("(Ben) is disconnected: it has answered nothing for 15 s")) << web->output();
  EXPECT_LT(cat.distance_m(), 0.001);
  for (Process* each : {left.get(), right.get(), sim.get()}) each->send(SIGINT);
  EXPECT_EQ(web->exit_code(), 0) << web->output();
}

// She goes on wishing it elsewhere all the time.
TEST_F(GatewayProgram, a_teacher_freezes_an_instrument_which_stays_where_it_is_until_it_is_thawed) {
  const auto sim = program("sim_server", in_session({"--scene", kScene, "--endless", "--export", file("out")}));
  const auto hand = program("device_bridge", in_session({"--device", "wish"}));
  const auto web = gateway();
  const int port = port_of(*web);
  Surgeon ada(port, "Ada", 0);
  EXPECT_TRUE(ada.leads());
  WebPeer tom(port, {"Tom", "theatre"}), eve(port, {"Eve", ""});
  const SessionOrder freeze{0, OrderKind::freeze, Vec3::Zero(), 1, 0, 0},
      thaw{0, OrderKind::thaw, Vec3::Zero(), 1, 0, 0};
  EXPECT_TRUE(eve.wait_until([&] { return eve.own_id() != kNobody; }));
  eve.say(LiveKind::order, freeze);
  EXPECT_TRUE(eve.wait_until([&] { return eve.was_told("led by somebody else"); }));
  EXPECT_TRUE(tom.wait_until([&] { return tom.own_id() != kNobody; }));
  tom.say(LiveKind::order, freeze);
  EXPECT_TRUE(sim->wait_for("scalpel is frozen where it is")) << sim->output();
  const Pose at = ada.peer.state->tools[0].pose_world;
  ada.place_m += Vec3(0.02, 0, 0.02);
  const std::size_t seen = ada.peer.states;
  EXPECT_TRUE(ada.waits_for([&] { return ada.peer.states > seen + 60; }));
  EXPECT_LT((ada.peer.state->tools[0].pose_world.position_m - at.position_m).norm(), 1e-9);
  tom.say(LiveKind::order, thaw);
  EXPECT_TRUE(ada.leads());
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  const auto events = json("out/report.json")["run"]["events"];
  EXPECT_EQ(events["instrument withdrawn"], 1) << "it is taken out before it follows";
  for (Process* each : {hand.get(), web.get()}) each->send(SIGINT), each->exit_code();
}

// The teacher begins anew while she cuts: her hand is where it was, in tissue that is whole again.
TEST_F(GatewayProgram, a_blade_in_the_tissue_cuts_nothing_when_the_session_begins_anew) {
  const auto sim = program("sim_server", in_session({"--scene", kScene, "--endless", "--export", file("out")}));
  const auto hand = program("device_bridge", in_session({"--device", "wish"}));
  const auto web = gateway();
  const int port = port_of(*web);
  Surgeon ada(port, "Ada", 0);
  EXPECT_TRUE(ada.leads());
  WebPeer tom(port, {"Tom", "theatre"});
  EXPECT_TRUE(tom.wait_until([&] { return tom.own_id() != kNobody; }));
  ada.place_m.z() = 0.005;
  std::size_t seen = ada.peer.states;
  EXPECT_TRUE(ada.waits_for([&] { return ada.peer.states > seen + 60; }));
  tom.say(LiveKind::order, SessionOrder{0, OrderKind::begin_anew, Vec3::Zero(), 1, 0, 0});
  EXPECT_TRUE(sim->wait_for("the session begins anew")) << sim->output();
  seen = ada.peer.states;
  EXPECT_TRUE(ada.waits_for([&] { return ada.peer.states > seen + 30; }));
  EXPECT_LT(ada.distance_m(), 0.02) << "it is in the scene";
  sim->send(SIGINT);
  EXPECT_TRUE(sim->exit_code()) << sim->output();
  EXPECT_GE(json("out/report.json")["outcome"]["incisions"], 1);
  const auto again = json("out/try_2/report.json");
  EXPECT_EQ(again["outcome"]["incisions"], 0) << again["run"]["events"];
  EXPECT_EQ(again["run"]["events"]["did not cut"], 1) << again["run"]["events"];
  for (Process* each : {hand.get(), web.get()}) each->send(SIGINT), each->exit_code();
}

// A second time it is frozen before the session goes on.
TEST_F(GatewayProgram, an_instrument_whose_hand_moves_in_a_pause_is_taken_out_before_it_follows) {
  const auto sim = program("sim_server", in_session({"--scene", kScene, "--endless", "--export", file("out")}));
  const auto hand = program("device_bridge", in_session({"--device", "wish"}));
  const auto web = gateway();
  const int port = port_of(*web);
  Surgeon ada(port, "Ada", 0);
  EXPECT_TRUE(ada.leads());
  WebPeer tom(port, {"Tom", "theatre"});
  EXPECT_TRUE(tom.wait_until([&] { return tom.own_id() != kNobody; }));
  const auto give = [&](OrderKind kind) { tom.say(LiveKind::order, SessionOrder{0, kind, Vec3::Zero(), 1, 0, 0}); };
  const auto moves_in_a_pause = [&](const Vec3& by_m) {
    give(OrderKind::pause);
    EXPECT_TRUE(sim->wait_for_next("paused")) << sim->output();
    ada.place_m += by_m;
    const std::size_t pings = tom.pings;  // some seconds later; no states come
    EXPECT_TRUE(tom.wait_until([&] { return tom.pings > pings; }, [&] { ada.peer.wish(0, ada.place_m); }));
  };
  moves_in_a_pause(Vec3(0.03, 0, 0));
  give(OrderKind::go_on);
  EXPECT_TRUE(ada.leads());
  const Pose at = ada.peer.state->tools[0].pose_world;
  moves_in_a_pause(Vec3(-0.03, 0, 0));
  give(OrderKind::freeze);
  give(OrderKind::go_on);
  const std::size_t seen = ada.peer.states;
  EXPECT_TRUE(ada.waits_for([&] { return ada.peer.states > seen + 60; }));
  EXPECT_LT((ada.peer.state->tools[0].pose_world.position_m - at.position_m).norm(), 0.001) << "it is frozen";
  sim->send(SIGINT);
  EXPECT_TRUE(sim->exit_code()) << sim->output();
  EXPECT_EQ(json("out/report.json")["run"]["events"]["instrument withdrawn"], 1);
  for (Process* each : {hand.get(), web.get()}) each->send(SIGINT), each->exit_code();
}

// The gateway goes on while its server dies, and has told what Tom wanted of that one.
TEST_F(GatewayProgram, orders_of_a_page_are_for_the_server_that_is_there) {
  auto sim = program("sim_server", in_session({"--scene", kScene, "--endless", "--export", file("out")}));
  const auto web = gateway();
  WebPeer tom(port_of(*web), {"Tom", "theatre"});
  EXPECT_TRUE(tom.wait_until([&] { return tom.own_id() != kNobody && tom.states > 5; }));
  tom.say(LiveKind::order, SessionOrder{0, OrderKind::begin_anew, Vec3::Zero(), 1, 0, 0});
  EXPECT_TRUE(sim->wait_for("the session begins anew")) << sim->output();
  std::size_t seen = tom.states;
  EXPECT_TRUE(tom.wait_until([&] { return tom.states > seen + 30; }));
  sim->send(SIGKILL);
  EXPECT_TRUE(sim->exit_code().has_value());
  sim = program("sim_server", in_session({"--resume", file("out"), "--endless"}));
  ASSERT_TRUE(sim->wait_for("the session goes on")) << sim->output();
  seen = tom.states;
  EXPECT_TRUE(tom.wait_until([&] { return tom.states > seen + 60; }));
  sim->send(SIGINT);
  EXPECT_TRUE(sim->exit_code()) << sim->output();
  EXPECT_TRUE(std::filesystem::exists(file("out/try_2")));
  EXPECT_FALSE(std::filesystem::exists(file("out/try_3"))) << sim->output();
  web->send(SIGINT), web->exit_code();
}

}  // namespace
}  // namespace sectio
