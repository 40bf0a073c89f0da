#include "tests/support/session_programs.h"

#include <unistd.h>

#include <cstdlib>

namespace sectio::test {

SessionPrograms::SessionPrograms() {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  directory = std::filesystem::path(testing::TempDir()) /
              ("sectio_" + std::string(test->name()) + "_" + std::to_string(getpid()));
  std::filesystem::create_directories(directory);
}

SessionPrograms::~SessionPrograms() {
  std::error_code ignored;
  std::filesystem::remove_all(directory, ignored);
}

std::unique_ptr<Process> SessionPrograms::program(const std::string& name, const Flags& flags) {
  return std::make_unique<Process>(std::string(SECTIO_BIN_DIR "/") + name, flags);
}

Flags SessionPrograms::in_session(Flags flags) const {
  flags.insert(flags.end(), {"--domain", std::to_string(network.domain), "--session", network.session});
  return flags;
}

std::unique_ptr<Process> SessionPrograms::server(Flags more, int viewers) const {
  more.insert(more.begin(), {"--scene", kScene, "--wait-for-tools", "--wait-for-viewers", std::to_string(viewers)});
  return program("sim_server", in_session(more));
}

std::unique_ptr<Process> SessionPrograms::one(const std::string& name, Flags more) const {
  more.insert(more.end(), {"--scene", kScene, "--export", file(name)});
  return program("sim_server", in_session(more));
}

std::unique_ptr<Process> SessionPrograms::bridge() const {
  return program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server"}));
}

std::unique_ptr<Process> SessionPrograms::viewer(const std::string& name, Flags more) const {
  more.insert(more.begin(), {"--name", name, "--report", file(name + ".json")});
  return program("render_client", in_session(more));
}

nlohmann::json SessionPrograms::json(const std::string& name) const {
  std::ifstream text(file(name));
  return nlohmann::json::parse(text);
}

std::string SessionPrograms::undisturbed_hash() const {
  const auto offline = program("sim_server", {"--scene", kScene, "--offline", "--export", file("whole")});
  EXPECT_EQ(offline->exit_code(), 0) << offline->output();
  return hash_of("whole");
}

std::unique_ptr<Process> SessionPrograms::at_a_desk(const std::string& script) const {
  write("desk.sh", script);
  return std::make_unique<Process>(
      "/usr/bin/xvfb-run", Flags{"-a", "-s", "-screen 0 800x600x24", "/bin/bash", file("desk.sh"), directory.string(),
                                 SECTIO_BIN_DIR, std::to_string(network.domain), network.session});
}

std::string SessionPrograms::scene_with_young(const std::string& young_pa) {
  std::ifstream file(kScene);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  };
  replace("young_pa: 5400", "young_pa: " + young_pa);
  replace("../", SECTIO_SOURCE_DIR "/deploy/");
  return text;
}

bool SessionPrograms::has_simulated(Process& server, double least_s) {
  const std::string unit = " s simulated";
  const auto newest_s = [&] {
    const std::size_t end = server.output().rfind(unit);
    if (end == std::string::npos) return 0.0;
    const std::size_t before = server.output().rfind(' ', end - 1);
    return before == std::string::npos ? 0.0 : std::atof(server.output().c_str() + before);
  };
  while (newest_s() < least_s)
    if (!server.wait_for_next(unit)) return false;
  return true;
}

void SessionPrograms::expect_equal_at_the_end(Process& viewer) {
  EXPECT_EQ(viewer.exit_code(), 0) << viewer.output();
  EXPECT_NE(viewer.output().find("equals server: yes"), std::string::npos) << viewer.output();
}

}  // namespace sectio::test
