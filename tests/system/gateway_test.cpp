// The gateway as a process, without a browser.
#include <turbojpeg.h>

#include <memory>

#include "tests/support/gateway_programs.h"
#include "tests/support/http.h"

namespace sectio {
namespace {

using test::http_get;
using test::HttpAnswer;
using test::Process;

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

}  // namespace
}  // namespace sectio
