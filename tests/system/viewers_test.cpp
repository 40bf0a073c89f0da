// The real programs on loopback: a scalpel opens the liver while viewers come late, are stopped, draw nothing, or see
// the server stall.
#include <chrono>
#include <sstream>
#include <thread>

#include "common/core/formatted.h"
#include "render_client/net/client_net.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Process;

class Viewers : public test::SessionPrograms {
 protected:
  // It has seen the session, and does nothing from then on.
  std::unique_ptr<Process> stopped_viewer() const {
    auto stopped = viewer("stopped", {"--no-pictures"});
    EXPECT_TRUE(stopped->wait_for("on the screen")) << stopped->output();
    stopped->send(SIGSTOP);
    return stopped;
  }
};

TEST_F(Viewers, A_ARCH_1_A_ARCH_3_pictures_go_on_while_a_step_takes_two_seconds) {
  const double stall_s = 2;
  auto sim = server({"--stall-at-s", "2", "--stall-s", "2", "--steps", "3000"});
  auto screen = viewer("screen", {"--size", "320x240", "--fps", "25"});
  auto hand = bridge();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  const nlohmann::json seen = json("screen.json");
  // Pictures without a new state are those of the stall; ten a second at least.
  EXPECT_GE(seen["frames_drawn"].get<int>() - seen["states_drawn"].get<int>(), 10 * stall_s) << seen.dump(1);
  EXPECT_LT(seen["max_gap_s"].get<double>(), stall_s / 4) << seen.dump(1);
  EXPECT_GT(seen["deltas_applied"].get<int>(), 0);
}

TEST_F(Viewers, D_2_late_and_stopped_viewers_end_with_the_servers_hash) {
  auto sim = server({"--steps", "4000"});
  auto first = viewer("first", {"--no-pictures"});
  auto hand = bridge();
  ASSERT_TRUE(first->wait_for("on the screen")) << first->output();
  const auto stopped = stopped_viewer();
  ASSERT_TRUE(sim->wait_for_next("simulated")) << sim->output();
  auto late = viewer("late", {"--no-pictures"});
  ASSERT_TRUE(late->wait_for("on the screen")) << late->output();
  ASSERT_TRUE(sim->wait_for_next("simulated")) << sim->output();
  stopped->send(SIGCONT);
  expect_equal_at_the_end(*first);
  expect_equal_at_the_end(*stopped);
  expect_equal_at_the_end(*late);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  // The one that was always there needed its first keyframe only: nobody held it up.
  EXPECT_EQ(json("first.json")["resyncs"], 0);
  EXPECT_GT(json("late.json")["first_step"].get<int>(), 500);
}

// The viewer is like a computer that was asleep: the server has given it up, and gives it the end all the same.
TEST_F(Viewers, D_2_a_viewer_that_fell_silent_gets_the_end_when_it_is_back) {
  auto sim = server({"--steps", "3500"});
  auto first = viewer("first", {"--no-pictures"});
  auto hand = bridge();
  ASSERT_TRUE(first->wait_for("on the screen")) << first->output();
  const auto stopped = stopped_viewer();
  expect_equal_at_the_end(*first);
  ASSERT_TRUE(sim->wait_for("went silent")) << sim->output();
  stopped->send(SIGCONT);
  expect_equal_at_the_end(*stopped);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
}

// Screen, null renderer, and one made of the wire alone: the server neither knows nor cares which it has.
TEST_F(Viewers, A_ARCH_8_a_viewer_may_draw_or_not_or_be_another_program) {
  auto sim = server({"--steps", "1500", "--export", file("out")}, 3);
  auto drawing = viewer("drawing", {"--size", "64x48", "--fps", "10"});
  auto null = viewer("null", {"--no-pictures"});
  auto net = std::make_unique<ClientNet>(network);
  World own;
  auto hand = bridge();
  const auto now_s = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  const auto at_the_end = [&] {
    net->poll(now_s(), own);
    return own.session_end() && own.catch_up() == own.session_end()->bodies;
  };
  const double give_up_s = now_s() + 60;
  while (!at_the_end() && now_s() < give_up_s) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_TRUE(own.session_end());
  EXPECT_EQ(own.catch_up(), own.session_end()->bodies);
  net.reset();  // the server waits for those who look
  expect_equal_at_the_end(*drawing);
  expect_equal_at_the_end(*null);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  const nlohmann::json report = json("out/report.json");
  for (const char* viewer : {"drawing.json", "null.json"})
    EXPECT_EQ(json(viewer)["bodies"][0]["topology_hash"], report["bodies"][0]["topology_hash"]);
}

// UDP sockets of a domain's port range, as the kernel lists them: "0100007F:6824".
std::vector<std::string> sockets_of(std::uint32_t domain) {
  const unsigned first = 7400 + 250 * domain;
  std::ifstream table("/proc/net/udp");
  std::vector<std::string> found;
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::string slot, address;
    fields >> slot >> address;
    const unsigned port = static_cast<unsigned>(std::stoul(address.substr(address.find(':') + 1), nullptr, 16));
    if (port >= first && port < first + 250) found.push_back(address);
  }
  return found;
}

TEST_F(Viewers, D_9_runs_on_loopback_without_display_and_without_multicast) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  auto sim = server({"--steps", "1000"});
  auto screen = viewer("screen", {"--size", "64x48", "--fps", "10", "--out", file("frames")});
  ASSERT_TRUE(screen->wait_for("connected")) << screen->output();
  const std::vector<std::string> sockets = sockets_of(network.domain);
  EXPECT_GE(sockets.size(), 4u);  // discovery and data, of both
  for (const std::string& address : sockets) EXPECT_EQ(address.substr(0, 8), "0100007F") << address;
  // Listeners for multicast would have the first two ports of the domain.
  for (const unsigned offset : {0u, 1u}) {
    const std::string port = formatted("%04X", 7400 + 250 * network.domain + offset);
    for (const std::string& address : sockets) EXPECT_NE(address.substr(9), port);
  }
  auto hand = bridge();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_TRUE(std::filesystem::directory_iterator(directory / "frames") != std::filesystem::directory_iterator());
}

}  // namespace
}  // namespace sectio
