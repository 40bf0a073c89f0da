// The three programs, as a test starts them: one session on a domain of its own, files in a directory of its own.
// Needs SECTIO_BIN_DIR and SECTIO_SOURCE_DIR.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/dds_session.h"
#include "tests/support/process.h"

namespace sectio::test {

using Flags = std::vector<std::string>;

class SessionPrograms : public testing::Test {
 protected:
  static constexpr const char* kScene = SECTIO_SOURCE_DIR "/deploy/scenes/liver_incision.yaml";
  static constexpr const char* kTrace = SECTIO_SOURCE_DIR "/deploy/traces/liver_incision.csv";

  SessionPrograms() {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    directory = std::filesystem::path(testing::TempDir()) /
                ("sectio_" + std::string(test->name()) + "_" + std::to_string(getpid()));
    std::filesystem::create_directories(directory);
  }
  ~SessionPrograms() override {
    std::error_code ignored;
    std::filesystem::remove_all(directory, ignored);
  }

  static std::unique_ptr<Process> program(const std::string& name, const Flags& flags) {
    return std::make_unique<Process>(std::string(SECTIO_BIN_DIR "/") + name, flags);
  }
  Flags in_session(Flags flags) const {
    flags.insert(flags.end(), {"--domain", std::to_string(network.domain), "--session", network.session});
    return flags;
  }

  // The clock starts when the viewers and all instruments are there.
  std::unique_ptr<Process> server(Flags more, int viewers = 1) const {
    more.insert(more.begin(), {"--scene", kScene, "--wait-for-tools", "--wait-for-viewers", std::to_string(viewers)});
    return program("sim_server", in_session(more));
  }
  std::unique_ptr<Process> bridge() const {
    return program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server"}));
  }
  std::unique_ptr<Process> viewer(const std::string& name, Flags more = {}) const {
    more.insert(more.begin(), {"--name", name, "--report", file(name + ".json")});
    return program("render_client", in_session(more));
  }

  std::string file(const std::string& name) const { return (directory / name).string(); }
  nlohmann::json json(const std::string& name) const {
    std::ifstream text(file(name));
    return nlohmann::json::parse(text);
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(file(name)) << text; }

  static void expect_equal_at_the_end(Process& viewer) {
    EXPECT_EQ(viewer.exit_code(), 0) << viewer.output();
    EXPECT_NE(viewer.output().find("equals server: yes"), std::string::npos) << viewer.output();
  }

  NetworkOptions network = own_session();
  std::filesystem::path directory;
};

}  // namespace sectio::test
