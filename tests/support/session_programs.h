// The three programs, as a test starts them: one session on a domain of its own, files in a directory of its own.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/dds_session.h"
#include "tests/support/process.h"

namespace sectio::test {

using Flags = std::vector<std::string>;

class SessionPrograms : public testing::Test {
 protected:
  static constexpr const char* kScene = SECTIO_SOURCE_DIR "/deploy/scenes/liver_incision.yaml";
  static constexpr const char* kTrace = SECTIO_SOURCE_DIR "/deploy/traces/liver_incision.csv";

  SessionPrograms();
  ~SessionPrograms() override;

  static std::unique_ptr<Process> program(const std::string& name, const Flags& flags);
  Flags in_session(Flags flags) const;

  // The clock starts when the viewers and all instruments are there.
  std::unique_ptr<Process> server(Flags more, int viewers = 1) const;
  // A server of kScene that exports to a folder of this name.
  std::unique_ptr<Process> one(const std::string& name, Flags more) const;
  std::unique_ptr<Process> bridge() const;
  std::unique_ptr<Process> viewer(const std::string& name, Flags more = {}) const;

  std::string file(const std::string& name) const { return (directory / name).string(); }
  nlohmann::json json(const std::string& name) const;
  void write(const std::string& name, const std::string& text) const { std::ofstream(file(name)) << text; }

  // The server has simulated so much, or more: one that is behind its clock says so at other moments.
  static bool has_simulated(Process& server, double least_s);

  // Time is asked of a clock here: for tests that vary the moment at which something happens.
  static void let_pass(std::chrono::milliseconds time) { std::this_thread::sleep_for(time); }
  static void expect_equal_at_the_end(Process& viewer);
  // The hash of the body in the folder to which a server exported.
  std::string hash_of(const std::string& folder) const {
    return json(folder + "/report.json")["bodies"][0]["topology_hash"];
  }
  // The hash with which kScene ends when nobody disturbs it: a whole run without a network.
  std::string undisturbed_hash() const;
  // A script of a person at a desktop without a screen: $1 is this test's folder, $2 that of the programs, $3 and $4
  // are domain and session. xvfb-run picks a free display, and ends the X server with the script.
  std::unique_ptr<Process> at_a_desk(const std::string& script) const;
  // The text of kScene with another Young's modulus, for a file anywhere.
  static std::string scene_with_young(const std::string& young_pa);

  NetworkOptions network = own_session();
  std::filesystem::path directory;
};

}  // namespace sectio::test
