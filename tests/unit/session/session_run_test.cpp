#include "sim_server/session/session_run.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/delta/journal.h"
#include "sim_server/session/rerun.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSteps = 3500, kEarlier = 2200;

class SessionRuns : public testing::Test {
 protected:
  SessionRuns()
      : directory(testing::TempDir() + "sectio_session_run_" + std::to_string(getpid())), there(directory + "/there") {
    fs::remove_all(directory);
  }
  ~SessionRuns() override { fs::remove_all(directory); }

  static StepInput input_of_step(std::uint64_t step) {
    StepInput input;
    const double s = static_cast<double>(step);
    ToolSample sample;
    sample.tool_id = 0;
    sample.source = 1;
    sample.sequence = step;
    sample.tool_time_s = 1e-3 * s;
    sample.pose_world = {Vec3(-0.02 + 1e-5 * s, 0, kOrganTop_m + 0.002 - std::min(0.006, 2e-5 * s)),
                         Eigen::Quaterniond::Identity()};
    input.samples.push_back(sample);
    return input;
  }
  static void go_on(SessionRun& run, std::uint64_t last) {
    while (run.steps() < last) {
      const StepInput input = input_of_step(run.steps() + 1);
      run.begin_step(7, input);
      run.end_step(run.step(input), 0);
    }
  }
  // The session up to a step, whose server then dies.
  void record() {
    SessionRun run(scene, there);
    go_on(run, kEarlier);
    earlier_hash = state_hash_of(run.simulation());
    go_on(run, kSteps);
    last_hash = state_hash_of(run.simulation());
    EXPECT_GT(run.simulation().mesh(0).revision(), 0u) << "nothing was cut";
  }
  void forget_first_inputs() const {
    std::fstream file(input_log_path(there), std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(1000);
    for (int i = 0; i < 100; ++i) file.put('x');
  }
  std::unique_ptr<SessionRun> resumed(std::uint64_t last_step, const std::string& to) {
    return SessionRun::resumed(scene, {there, last_step}, to, epoch);
  }

  const Scene scene = organ_scene();
  const std::string directory, there;
  std::uint64_t earlier_hash = 0, last_hash = 0;
  std::optional<std::uint64_t> epoch;
};

TEST_F(SessionRuns, begin_without_the_parts_of_an_earlier_run) {
  fs::create_directories(there);
  const std::string name = scene.bodies[0].name;
  std::ofstream(there + "/report.json") << R"({"bodies": [{"name": ")" << name << R"("}, {"name": ")" << name
                                        << R"(.1"}, {"name": "other.1"}, {"name": 7}, {"name": ")" << name
                                        << R"(./../x"}]})";
  for (const std::string& file : {name + ".1.obj", name + ".2.obj", name + ".obj", std::string("other.1.obj")})
    std::ofstream(there + "/" + file) << "v 0 0 0\n";
  { SessionRun run(scene, there); }
  EXPECT_FALSE(fs::exists(there + "/" + name + ".1.obj"));
  for (const std::string& other : {name + ".2.obj", name + ".obj", std::string("other.1.obj")})
    EXPECT_TRUE(fs::exists(there + "/" + other)) << other << " isn't a part of that run";
}

TEST_F(SessionRuns, goes_on_from_its_last_checkpoint) {
  record();
  forget_first_inputs();
  const auto run = resumed(~std::uint64_t{0}, there);
  EXPECT_EQ(run->steps(), kSteps);
  EXPECT_EQ(epoch, 7u);
  EXPECT_EQ(state_hash_of(run->simulation()), last_hash);
  EXPECT_EQ(read_journal(there + "/journal").front().mesh.hash(), run->simulation().mesh(0).hash());
}

TEST_F(SessionRuns, has_the_report_of_a_session_that_was_never_interrupted) {
  record();
  SessionRun whole(scene, directory + "/whole");
  go_on(whole, kSteps + 100);
  auto run = resumed(~std::uint64_t{0}, there);
  go_on(*run, kSteps + 100);
  const auto expected = nlohmann::json::parse(whole.recorder().finish().report);
  const auto report = nlohmann::json::parse(run->recorder().finish().report);
  EXPECT_EQ(report["bodies"][0]["topology_hash"], expected["bodies"][0]["topology_hash"]);
  for (const char* figure : {"steps", "cuts_made", "contact_time_s", "events"})
    EXPECT_EQ(report["run"][figure], expected["run"][figure]) << figure;
}

TEST_F(SessionRuns, branches_off_from_an_earlier_checkpoint_and_can_be_run_from_its_beginning) {
  record();
  const auto run = resumed(kEarlier, directory + "/branch");
  EXPECT_EQ(run->steps(), kEarlier);
  EXPECT_EQ(state_hash_of(run->simulation()), earlier_hash);
  EXPECT_EQ(read_journal(directory + "/branch/journal").front().mesh.hash(), run->simulation().mesh(0).hash());
  InputLogReader inputs(input_log_path(directory + "/branch"));
  Simulation again(scene);
  const Rerun from_beginning = rerun(inputs, again, [](const StepInputs&, const StepOutput&) {});
  EXPECT_EQ(from_beginning.difference, "");
  EXPECT_EQ(from_beginning.steps, kEarlier);
  EXPECT_EQ(run->inputs()->read_from(2, 1).at(0).step, 2u);
}

TEST_F(SessionRuns, runs_all_steps_again_when_no_checkpoint_is_whole) {
  record();
  ASSERT_FALSE(fs::is_empty(checkpoints_path(there)));
  for (const fs::directory_entry& file : fs::directory_iterator(checkpoints_path(there)))
    fs::resize_file(file.path(), file.file_size() / 2);
  const auto run = resumed(~std::uint64_t{0}, there);
  EXPECT_EQ(run->steps(), kSteps);
  EXPECT_EQ(state_hash_of(run->simulation()), last_hash);
}

TEST_F(SessionRuns, goes_on_without_checkpoints_where_they_can_not_be_written) {
  SessionRun run(scene, there);
  fs::remove_all(checkpoints_path(there));
  std::ofstream(checkpoints_path(there)) << "in the way";
  go_on(run, kSteps);
  EXPECT_EQ(run.steps(), kSteps);
  while (run.take_faults().empty()) std::this_thread::yield();
}

}  // namespace
}  // namespace sectio::test
