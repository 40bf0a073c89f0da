#include "tests/support/linked_session.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "common/core/report_figures.h"
#include "tests/support/fine_scene.h"
#include "tests/support/process.h"

namespace sectio::test {

namespace {

using Clock = std::chrono::steady_clock;
using Flags = std::vector<std::string>;

constexpr std::chrono::seconds kPatience{90};

// One run, on a network that has the server on host 0, the hand on 1 and the viewers behind them.
class Run {
 public:
  Run(const LinkedSession& session, std::filesystem::path directory)
      : session_(session), directory_(std::move(directory)), network_(hosts(session)) {
    if (!session.secured) return;
    Process keys(SECTIO_SOURCE_DIR "/deploy/keys", {"make", keys_of(""), "server", "trainee-0", "observer"});
    if (keys.exit_code() != 0) throw std::runtime_error(keys.output());
  }

  SessionFigures go() {
    const std::string root = SECTIO_SOURCE_DIR "/deploy/";
    const std::size_t count = session_.viewers.size();
    const bool late = session_.late_s > 0;
    auto server =
        start(0, "sim_server",
              {"--scene", scene(), "--wait-for-tools", "--wait-for-viewers", std::to_string(late ? count - 1 : count)});
    auto hand = start(1, "device_bridge",
                      {"--trace", root + "traces/" + session_.scene + ".csv", "--wait-for-server", "--log", log()});
    std::vector<std::unique_ptr<Process>> viewers;
    for (std::size_t i = 0; i < count; ++i) {
      if (late && i + 1 == count) wait_for_step(*server);
      begun_.push_back(Clock::now());
      viewers.push_back(
          start(2 + i, "render_client", {"--name", std::to_string(i), "--no-pictures", "--report", report(i)}));
    }
    SessionFigures figures;
    figures.viewers.resize(count);
    for (std::size_t i = count; i-- > 0;) {
      viewers[i]->wait_for("on the screen", kPatience);
      figures.viewers[i].first_state_s = std::chrono::duration<double>(Clock::now() - begun_[i]).count();
    }
    note_end(*server, figures);
    note_end(*hand, figures);
    for (std::size_t i = 0; i < count; ++i) {
      note_end(*viewers[i], figures);
      read_report(i, figures.viewers[i]);
    }
    read_log(figures);
    figures.offered = network_.up(0);
    for (std::size_t host = 0; host < 2 + count; ++host)
      figures.dropped += network_.up(host).dropped + network_.down(host).dropped;
    return figures;
  }

 private:
  static std::vector<HostLinks> hosts(const LinkedSession& session) {
    std::vector<HostLinks> all{session.server, session.hand};
    all.insert(all.end(), session.viewers.begin(), session.viewers.end());
    return all;
  }
  std::unique_ptr<Process> start(std::size_t host, const std::string& program, Flags flags) {
    const std::string role = host == 0 ? "server" : host == 1 ? "trainee-0" : "observer";
    const Flags network = network_.network_flags(host, session_.secured ? keys_of(role) : "");
    flags.insert(flags.end(), network.begin(), network.end());
    flags.insert(flags.end(), {"--session", "linked"});
    const std::string bin = session_.bin.empty() ? SECTIO_BIN_DIR : session_.bin;
    return std::make_unique<Process>(bin + "/" + program, flags, network_.host(host));
  }
  std::string scene() const {
    if (session_.finer > 0) return fine_scene(session_.scene, session_.finer, session_.duration_s, directory_);
    return SECTIO_SOURCE_DIR "/deploy/scenes/" + session_.scene + ".yaml";
  }
  std::string keys_of(const std::string& role) const { return (directory_ / "keys" / role).string(); }
  std::string log() const { return (directory_ / "force.csv").string(); }
  std::string report(std::size_t viewer) const { return (directory_ / (std::to_string(viewer) + ".json")).string(); }

  void wait_for_step(Process& server) const {
    server.wait_for("the session begins", kPatience);
    for (int s = 0; s < session_.late_s; ++s) server.wait_for_next("simulated", kPatience);
  }

  static void note_end(Process& program, SessionFigures& figures) {
    const std::optional<int> code = program.exit_code(kPatience);
    if (code != 0) figures.trouble += program.name() + ":\n" + program.output();
  }

  void read_report(std::size_t viewer, ViewerFigures& figures) const {
    std::ifstream file(report(viewer));
    const nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
    if (json.is_discarded()) return;
    figures.states = json["states_drawn"];
    figures.max_gap_s = json["max_gap_s"];
    figures.states_per_s = figures.states / std::max(1e-3, json["frames_drawn"].get<double>() / 25);
    figures.equals_server = json["bodies"].empty() ? "unknown" : json["bodies"][0]["equals_server"];
  }

  void read_log(SessionFigures& figures) const {
    std::ifstream file(log());
    std::string line, cell;
    std::vector<double> ages_s;
    std::getline(file, line);
    while (std::getline(file, line)) {
      std::istringstream cells(line);
      for (int i = 0; i < 13; ++i) std::getline(cells, cell, ',');
      if (const double age_s = std::stod(cell); age_s >= 0) ages_s.push_back(age_s);
    }
    if (ages_s.empty()) return;
    figures.model_age_median_s = quantile(ages_s, 0.5);
    figures.model_age_p99_s = quantile(ages_s, 0.99);
    figures.model_age_max_s = *std::ranges::max_element(ages_s);
  }

  const LinkedSession& session_;
  std::filesystem::path directory_;
  VirtualNetwork network_;
  std::vector<Clock::time_point> begun_;
};

}  // namespace

SessionFigures run(const LinkedSession& session, const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  return Run(session, directory).go();
}

}  // namespace sectio::test
