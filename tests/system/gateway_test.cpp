// The gateway as a process, without a browser.
#include <turbojpeg.h>

#include <memory>

#include "tests/support/http.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::http_get;
using test::HttpAnswer;
using test::Process;

class GatewayProgram : public test::SessionPrograms {
 protected:
  void SetUp() override {
    for (const char* name : {"index.html", "page.css", "page.js", "sectio.js", "sectio.wasm"}) write(name, name);
  }
  std::unique_ptr<Process> gateway() const { return program("gateway", in_session({"--page", directory.string()})); }
  static int port_of(Process& gateway) {
    EXPECT_TRUE(gateway.wait_for("/#")) << gateway.output();
    return std::stoi(gateway.output().substr(gateway.output().find("127.0.0.1:") + 10));
  }
};

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

}  // namespace
}  // namespace sectio
