// The gateway against clients that are no pages: one line says who was disconnected and why, its memory stays what it
// was, and a person who holds an instrument notices nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "tests/support/gateway_programs.h"
#include "tests/support/http.h"
#include "tests/support/web_peer.h"

namespace sectio::test {
namespace {

constexpr std::size_t kMostConnections = 256, kOthers = 40;  // files of a gateway that aren't connections
constexpr std::size_t kGrowth_bytes = std::size_t{32} << 20;

// A person at a page who holds the first scalpel still, in a thread of her own.
class Surgeon {
 public:
  explicit Surgeon(int port) : peer_(port, {"Ada", "theatre"}) {
    EXPECT_TRUE(peer_.wait_until([&] { return peer_.own_id() != kNobody && peer_.scene; }));
    peer_.say(LiveKind::claim, ToolClaim{0, ClaimAction::claim});
    place_m_ = peer_.scene->camera.target_world_m + Vec3(0, 0, 0.06);
    EXPECT_TRUE(peer_.wait_until([&] { return distance_m() < 0.0005; }, [&] { peer_.wish(0, place_m_); }))
        << "the scalpel is where she wants it";
    thread_ = std::jthread([this](const std::stop_token& stop) { hold(stop); });
  }
  std::size_t states() const { return states_; }
  // Her link still lives, and the scalpel was always hers and where she held it.
  void expect_undisturbed() {
    const std::size_t before = states_;
    while (states_ < before + 30 && !is_lost_) std::this_thread::yield();
    thread_ = {};
    EXPECT_FALSE(is_lost_);
    EXPECT_EQ(peer_.holder(0), peer_.own_id());
    EXPECT_LT(farthest_m_, 0.001);
    EXPECT_EQ(peer_.goodbye, "");
  }

 private:
  double distance_m() const {
    if (!peer_.state || peer_.state->tools.empty() || !peer_.state->tools[0].present) return 1e9;
    return (peer_.state->tools[0].pose_world.position_m - place_m_).norm();
  }
  void hold(const std::stop_token& stop) {
    while (!stop.stop_requested() && !is_lost_) {
      peer_.wish(0, place_m_);
      is_lost_ = !peer_.read(std::chrono::milliseconds(10));
      farthest_m_ = std::max(farthest_m_, distance_m());
      states_ = peer_.states;
    }
  }

  WebPeer peer_;
  Vec3 place_m_ = Vec3::Zero();
  double farthest_m_ = 0;
  std::atomic<bool> is_lost_ = false;
  std::atomic<std::size_t> states_ = 0;
  std::jthread thread_;
};

class HostileBrowser : public GatewayPrograms {
 protected:
  void SetUp() override {
    GatewayPrograms::SetUp();
    constexpr char kTwoTools[] = SECTIO_SOURCE_DIR "/deploy/scenes/skin_two.yaml";
    server_ = program("sim_server", in_session({"--scene", kTwoTools, "--endless"}));
    for (const char* tool : {"0", "1"})
      hands_.push_back(program("device_bridge", in_session({"--device", "wish", "--tool-id", tool})));
    gateway_ = gateway();
    port_ = port_of(*gateway_);
    surgeon_ = std::make_unique<Surgeon>(port_);
    before_bytes_ = bytes();
  }
  void TearDown() override {
    surgeon_->expect_undisturbed();
    EXPECT_LT(bytes(), before_bytes_ + kGrowth_bytes);
    surgeon_.reset();
    for (const auto& hand : hands_) hand->send(SIGINT);
    for (const auto& hand : hands_) EXPECT_EQ(hand->exit_code(), 0) << hand->output();
    server_->send(SIGINT);
    const std::optional<int> code = server_->exit_code();
    EXPECT_TRUE(code == 0 || code == 3) << "3: nobody has cut what the scene expects; " << server_->output();
    EXPECT_EQ(gateway_->exit_code(), 0) << gateway_->output();
  }
  // The most memory that the gateway has had.
  std::size_t bytes() const {
    std::ifstream status("/proc/" + std::to_string(gateway_->id()) + "/status");
    std::string word;
    while (status >> word)
      if (word == "VmHWM:") return status >> word, std::stoull(word) * 1024;
    return 0;
  }
  std::size_t open_files() const {
    const std::filesystem::directory_iterator files("/proc/" + std::to_string(gateway_->id()) + "/fd");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }
  void expect_line(const std::string& fault) {
    EXPECT_TRUE(gateway_->wait_for("is disconnected: it " + fault)) << gateway_->output();
  }
  // Until the gateway has had enough; returns the number of calls.
  template <class Send>
  static std::size_t send_until_closed(std::size_t most, const Send& send) {
    std::size_t count = 0;
    while (count < most && send()) ++count;
    return count;
  }
  // Somebody who means well comes in, as soon as there is room.
  void expect_room_for_another() {
    for (bool is_in = false; !is_in;) {
      WebPeer ben(port_, {"Ben", ""});
      is_in = ben.wait_until([&] { return ben.own_id() != kNobody && ben.states > 0; });
    }
  }

  std::unique_ptr<Process> server_, gateway_;
  std::vector<std::unique_ptr<Process>> hands_;
  std::unique_ptr<Surgeon> surgeon_;
  int port_ = 0;
  std::size_t before_bytes_ = 0;
};

TEST_F(HostileBrowser, that_shows_a_page_of_another_site) {
  WebPeer eve(port_);
  eve.send_raw("GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://elsewhere.example\r\nUpgrade: websocket\r\n" +
               std::string("Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n") +
               "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: " + live_protocol() + "\r\n\r\n");
  EXPECT_TRUE(gateway_->wait_for("a page of another site is refused")) << gateway_->output();
  EXPECT_TRUE(eve.is_closed_in(std::chrono::seconds(20)));
}

TEST_F(HostileBrowser, that_announces_a_gigabyte_and_says_no_more) {
  WebPeer eve(port_);
  eve.shake_hands();
  eve.send_raw(WebPeer::header(1 << 30));
  expect_line("has said nothing for 10 s");
  EXPECT_TRUE(eve.is_closed_in(std::chrono::seconds(20)));
}

TEST_F(HostileBrowser, that_sends_a_gigabyte) {
  const std::string part(1 << 16, 'x');
  WebPeer eve(port_, {"Eve", ""});
  eve.send_raw(WebPeer::header(1 << 30));
  EXPECT_LT(send_until_closed(1 << 14, [&] { return eve.send_raw(part); }), std::size_t{1 << 10}) << "64 MB";
  expect_line("has sent a message of more than 4096 bytes");
  WebPeer pieces(port_, {"Eve", ""});
  const std::string piece = WebPeer::header(4000, false) + std::string(4000, 'x');
  pieces.send_raw(piece);
  EXPECT_LT(send_until_closed(1 << 18, [&] { return pieces.send_raw(std::string(1, 0) + piece.substr(1)); }),
            std::size_t{1 << 14});
  WebPeer post(port_);
  post.send_raw("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1073741824\r\n\r\n");
  EXPECT_LT(send_until_closed(1 << 14, [&] { return post.send_raw(part); }), std::size_t{1 << 10});
}

TEST_F(HostileBrowser, that_comes_a_thousand_times_and_says_little_or_nothing) {
  std::vector<std::unique_ptr<WebPeer>> crowd;
  for (int i = 0; i < 1000; ++i) {
    crowd.push_back(std::make_unique<WebPeer>(port_));
    if (i % 4 == 1) crowd.back()->send_raw("GET / HT");
    if (i % 4 == 2) crowd.back()->shake_hands();
    if (i % 4 == 3) crowd.back()->send_raw("GET /sectio.wasm HTTP/1.1\r\nHost: localhost\r\n");
  }
  expect_line("is one of more than 256 connections");
  EXPECT_EQ(http_get(port_, "/version").status, 200) << "whoever asks comes before whoever doesn't";
  EXPECT_LE(open_files(), kMostConnections + kOthers);
  expect_line("has said nothing for 10 s");
  expect_room_for_another();
  for (auto& each : crowd) EXPECT_TRUE(each->is_closed_in(std::chrono::seconds(60)));
}

TEST_F(HostileBrowser, whose_hand_moves_at_100_m_per_s) {
  WebPeer eve(port_, {"Eve", "theatre"});
  ASSERT_TRUE(eve.wait_until([&] { return eve.own_id() != kNobody; }));
  eve.say(LiveKind::claim, ToolClaim{1, ClaimAction::claim});
  ASSERT_TRUE(eve.wait_until([&] { return eve.holder(1) == eve.own_id(); }));
  int wishes = 0;
  eve.wait_until([&] { return wishes > 1000; }, [&] { eve.wish(1, Vec3(++wishes % 2, 0, 0.1)); });
  EXPECT_LT(wishes, 1000);
  expect_line("has moved an instrument beyond the limit of speed 100 times in a row");
  WebPeer ben(port_, {"Ben", "theatre"});
  EXPECT_TRUE(ben.wait_until([&] { return ben.own_id() != kNobody && ben.holder(1) == kNobody; }));
}

TEST_F(HostileBrowser, that_moves_the_instrument_of_another) {
  for (const char* token : {"theatre", "", "guess"}) {
    WebPeer eve(port_, {"Eve", token});
    int wishes = 0;
    eve.wait_until([&] { return wishes > 1000; }, [&] { ++wishes, eve.wish(0, Vec3(1, 1, 1)); });
    EXPECT_LT(wishes, 1000) << token;
    EXPECT_TRUE(gateway_->wait_for("(Eve) is disconnected: it goes on with what was refused")) << gateway_->output();
  }
}

TEST_F(HostileBrowser, that_says_too_much) {
  WebPeer eve(port_, {"Eve", "theatre"});
  EXPECT_LT(send_until_closed(1 << 20,
                              [&] {
                                return eve.say(LiveKind::hello, Hello{"Eve", ""});
                              }),
            std::size_t{1 << 18});
  expect_line("sends more than 500 messages a second");
}

}  // namespace
}  // namespace sectio::test
