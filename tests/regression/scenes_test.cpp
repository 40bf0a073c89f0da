// Every scene of deploy/scenes, offline: the run is ok and is what tests/regression/golden.json holds, and its journal
// replays to the same bodies. One scene for each kind of model is run twice, and the runs are alike to the last bit;
// checkpoints_test.cpp runs every scene a second time. A change of a scene's outcome on purpose renews the file
// (SECTIO_RENEW_GOLDEN=1 in the environment, or `ninja renew_golden`), and the commit shows it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/delta/journal.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/offline_run.h"
#include "tests/regression/shipped_scenes.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

const fs::path kGolden = SECTIO_SOURCE_DIR "/tests/regression/golden.json";

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool renewing() {
  const char* renew = std::getenv("SECTIO_RENEW_GOLDEN");
  return renew != nullptr && std::string(renew) == "1";
}

ordered_json golden() {
  const std::string text = read_file(kGolden);
  return text.empty() ? ordered_json::object() : ordered_json::parse(text);
}

// The part of a report that must stay: each body's revision and hash, and numbers that show what has changed.
ordered_json essence(const ordered_json& report) {
  ordered_json e;
  e["steps"] = report["run"]["steps"];
  e["cuts_made"] = report["run"]["cuts_made"];
  e["cuts_refused"] = report["run"]["cuts_refused"];
  for (const ordered_json& body : report["bodies"])
    e["bodies"].push_back({{"name", body["name"]},
                           {"triangles", body["triangles"]},
                           {"components", body["components"]},
                           {"revision", body["revision"]},
                           {"topology_hash", body["topology_hash"]}});
  return e;
}

class Scenes : public testing::TestWithParam<std::string> {
 protected:
  Scenes() : directory(fs::path(testing::TempDir()) / ("sectio_regression_" + std::to_string(getpid()))) {}
  ~Scenes() override { fs::remove_all(directory); }

  // The report without the times that steps took.
  ordered_json run(const std::string& name) const {
    const Scene scene = prepared(load_scene((kScenes / (GetParam() + ".yaml")).string(), standard_traits()));
    ordered_json report = ordered_json::parse(run_offline(scene, 0, (directory / name).string()).report);
    for (const char* time : {"step_time_total_s", "step_time_median_s", "step_time_p99_s", "processor_time_s"})
      report["run"].erase(time);
    for (ordered_json& body : report["bodies"])
      for (const char* time : {"cpu_s_per_s", "cpu_estimate_s_per_s", "cpu_while_cut_s_per_s",
                               "cpu_while_cut_estimate_s_per_s", "cut_step_s", "cut_step_estimate_s"})
        body["check"].erase(time);
    return report;
  }

  fs::path directory;
};

INSTANTIATE_TEST_SUITE_P(Deployed, Scenes, testing::ValuesIn(scene_names()),
                         [](const auto& scene) { return scene.param; });

// Surfaces, tetrahedra, a lattice, templates, and bodies that touch.
constexpr std::string_view kRunTwice[] = {"liver_incision", "bar_volume_cut", "bar_lattice_cut", "incision_templates",
                                          "two_organs"};

TEST_P(Scenes, D_8_the_run_and_its_replay_are_as_they_were) {
  const ordered_json first = run("first");
  if (std::ranges::find(kRunTwice, GetParam()) != std::end(kRunTwice)) {
    EXPECT_EQ(first, run("second"));
    for (const fs::directory_entry& file : fs::directory_iterator(directory / "first")) {
      if (!file.is_regular_file() || file.path().filename() == "report.json") continue;  // checkpoints go by the clock
      EXPECT_EQ(read_file(file.path()), read_file(directory / "second" / file.path().filename())) << file.path();
    }
  }

  EXPECT_TRUE(first["ok"].get<bool>()) << first["reasons"].dump();

  const std::vector<JournalBody> replayed = read_journal((directory / "first" / "journal").string());
  ASSERT_EQ(replayed.size(), first["bodies"].size());
  for (std::size_t b = 0; b < replayed.size(); ++b) {
    const ordered_json& body = first["bodies"][b];
    EXPECT_EQ(replayed[b].mesh.hash(), std::stoull(body["topology_hash"].get<std::string>(), nullptr, 16));
    EXPECT_EQ(replayed[b].mesh.revision(), body["revision"].get<std::uint64_t>());
    EXPECT_TRUE(body["closed"].get<bool>() && body["manifold"].get<bool>());
  }
  const std::vector<ToolSpec> tools = load_scene((kScenes / (GetParam() + ".yaml")).string(), standard_traits()).tools;
  const bool cuts = std::ranges::any_of(tools, [](const ToolSpec& tool) { return tool.kind != "probe"; });
  EXPECT_EQ(first["run"]["cuts_made"] > 0, cuts);

  ordered_json known = golden();
  if (renewing()) {
    known[GetParam()] = essence(first);
    std::ofstream(kGolden) << known.dump(2) << '\n';
  } else {
    ASSERT_TRUE(known.contains(GetParam())) << "not in golden.json";
    EXPECT_EQ(essence(first), known[GetParam()]) << "on purpose? then: ninja renew_golden";
  }
}

TEST(Golden, knows_no_scene_that_is_gone) {
  const std::vector<std::string> names = scene_names();
  const ordered_json known = golden();
  ordered_json kept = ordered_json::object();
  for (const std::string& name : names)
    if (known.contains(name)) kept[name] = known[name];
  if (renewing()) std::ofstream(kGolden) << kept.dump(2) << '\n';
  EXPECT_EQ(golden().size(), kept.size());
}

}  // namespace
}  // namespace sectio
