// Programs that speak different versions of the wire don't exchange messages, and each says so in one line.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "render_client/net/client_net.h"
#include "sim_server/net/server_net.h"
#include "tests/support/moving_world.h"
#include "tests/support/patience.h"
#include "tests/support/replica_viewer.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::kGiveUp;
using test::MovingWorld;
using test::Process;

// A server of the next version, in this process.
struct NextServer {
  explicit NextServer(NetworkOptions network) {
    network.protocol = kProtocolVersion + 1;
    net = std::make_unique<ServerNet>(ServerNetOptions{network, 1000, 1}, world.scene(network.session),
                                      std::vector{world.mesh()});
  }
  void step() {
    const StepOutput output = world.step(true);
    net->publish(output, world.view(), 0.001);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  MovingWorld world{2};
  std::unique_ptr<ServerNet> net;
};

class Protocol : public test::SessionPrograms {
 protected:
  static std::string version(std::uint32_t difference) { return std::to_string(kProtocolVersion + difference); }
  static int count(const std::string& text, const std::string& part) {
    int n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
  }
};

TEST_F(Protocol, a_server_and_a_viewer_of_two_versions_exchange_nothing_and_say_so_once_each) {
  testing::internal::CaptureStderr();
  NextServer server(network);
  const auto screen = viewer("screen", {"--no-pictures"});
  const auto end = std::chrono::steady_clock::now() + kGiveUp;
  const std::string said_by_viewer =
      "sim_server speaks protocol " + version(1) + ", this program " + version(0) + ": they exchange no messages";
  while (!screen->wait_for(said_by_viewer, std::chrono::seconds(0)) && std::chrono::steady_clock::now() < end)
    server.step();
  for (int i = 0; i < 1000; ++i) server.step();  // time for everything else that could be said, or sent
  screen->send(SIGINT);
  EXPECT_EQ(screen->exit_code(), 1) << "it has met nobody";
  EXPECT_EQ(count(screen->output(), said_by_viewer), 1) << screen->output();
  EXPECT_NE(screen->output().find("was met"), std::string::npos) << screen->output();
  EXPECT_EQ(screen->output().find("damaged"), std::string::npos) << screen->output();
  EXPECT_EQ(server.net->viewers(), 0u);
  const std::string said_by_server = testing::internal::GetCapturedStderr();
  EXPECT_EQ(count(said_by_server, " speaks protocol " + version(0) + ", this program " + version(1)), 1)
      << said_by_server;
}

TEST_F(Protocol, a_bridge_hears_of_the_other_version_and_of_no_server) {
  NextServer server(network);
  const auto hand = program("device_bridge", in_session({"--trace", kTrace, "--duration-s", "3"}));
  const auto end = std::chrono::steady_clock::now() + kGiveUp;
  while (!hand->exit_code(std::chrono::seconds(0)) && std::chrono::steady_clock::now() < end) server.step();
  EXPECT_EQ(hand->exit_code(), 1) << hand->output();
  EXPECT_EQ(count(hand->output(), "speaks protocol " + version(1)), 1) << hand->output();
  EXPECT_NE(hand->output().find("was met"), std::string::npos) << hand->output();
  std::vector<ToolSample> samples;
  server.net->take_samples(samples);
  EXPECT_TRUE(samples.empty());
}

TEST_F(Protocol, a_server_of_the_same_version_beside_it_is_followed) {
  NextServer next(network);
  MovingWorld world(2);
  ServerNet ours({network, 1000, 2}, world.scene(network.session), {world.mesh()});
  ClientNet client(network);
  World replica;
  Frame frame;
  const auto end = std::chrono::steady_clock::now() + kGiveUp;
  bool seen = false;
  for (double now_s = 0; !seen && std::chrono::steady_clock::now() < end; now_s += 0.001) {
    next.step();
    const StepOutput output = world.step(false);
    ours.publish(output, world.view(), 0.001);
    client.poll(now_s, replica);
    seen = replica.frame(now_s, frame);
  }
  EXPECT_TRUE(seen);
  EXPECT_EQ(replica.servers(), 1u);
  EXPECT_EQ(client.counts().damaged, 0u);
}

}  // namespace
}  // namespace sectio
