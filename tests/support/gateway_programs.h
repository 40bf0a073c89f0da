// A session that browsers take part in: the programs, with a gateway whose token is "theatre".
#pragma once

#include <memory>
#include <string>

#include "tests/support/session_programs.h"

namespace sectio::test {

class GatewayPrograms : public SessionPrograms {
 protected:
  void SetUp() override {
    for (const char* name : {"index.html", "page.css", "page.js", "hand.js", "headset.js", "orders.js", "tries.js",
                             "sectio.js", "sectio.wasm"})
      write(name, name);
  }
  std::unique_ptr<Process> gateway(const Flags& more = {}) const {
    Flags flags{"--page", directory.string(), "--token", "theatre"};
    flags.insert(flags.end(), more.begin(), more.end());
    return program("gateway", in_session(flags));
  }
  static int port_of(Process& gateway) {
    EXPECT_TRUE(gateway.wait_for("/#")) << gateway.output();
    const std::size_t at = gateway.output().find("127.0.0.1:");
    return at == std::string::npos ? 0 : std::stoi(gateway.output().substr(at + 10));
  }
};

}  // namespace sectio::test
