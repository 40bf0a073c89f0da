#include "sim_server/session/input_log.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "sim_server/session/rerun.h"
#include "sim_server/session/step_record.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

class InputLogs : public testing::Test {
 protected:
  InputLogs() { std::filesystem::remove(path); }
  ~InputLogs() override { std::filesystem::remove(path); }

  // A cut of `steps` steps, each kept as it was, or as `change` makes it.
  void record(std::uint64_t steps, const std::function<void(StepRecord&)>& change = {}) {
    Operation op(organ_scene());
    InputLog log(path, {"organ", {"organ"}, state_hash_of(op.simulation)});
    for (std::uint64_t k = 1; k <= steps; ++k) {
      StepInput input;
      const double s = static_cast<double>(k);
      input.samples.push_back(op.sample(0, {Vec3(-0.02 + 2e-5 * s, 0, kOrganTop_m + 0.002 - std::min(0.006, 2e-5 * s)),
                                            Eigen::Quaterniond::Identity()}));
      if (k == 5) input.gravity_m_per_s2 = Vec3(0, -3, -9);
      input.spare_idle_bodies = k % 7 == 0;
      StepRecord record = record_of(k, input, op.simulation);
      if (change) change(record);
      EXPECT_EQ(log.append({7, k - 1, {record}}), std::nullopt);
      op.step(input);
    }
    EXPECT_GT(op.deltas, 0u) << "nothing was cut";
    last_hash = state_hash_of(op.simulation);
  }
  std::string bytes() const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  bool is_torn(const std::string& bytes) const {
    std::ofstream(path, std::ios::binary) << bytes;
    InputLogReader reader(path);
    while (reader.next()) {
    }
    EXPECT_FALSE(reader.damage().empty());
    return reader.is_torn();
  }
  Rerun again() {
    InputLogReader reader(path);
    Simulation simulation(organ_scene());
    const Rerun result = rerun(reader, simulation, [](const StepInputs&, const StepOutput&) {});
    rerun_hash = state_hash_of(simulation);
    return result;
  }

  std::string path = testing::TempDir() + "sectio_inputs_" + std::to_string(getpid());
  std::uint64_t last_hash = 0, rerun_hash = 0;
};

TEST_F(InputLogs, a_session_that_is_run_again_is_the_same_bit_for_bit) {
  record(600);
  const Rerun run = again();
  EXPECT_EQ(run.difference, "");
  EXPECT_EQ(run.steps, 600u);
  EXPECT_EQ(run.last_epoch, 7u);
  EXPECT_EQ(rerun_hash, last_hash);
}

TEST(StepRecords, a_time_is_so_many_whole_steps) {
  for (std::uint64_t steps = 0; steps < 5000; ++steps)
    EXPECT_EQ(steps_until(1e-3 * static_cast<double>(steps), 1e-3), steps);
  EXPECT_EQ(steps_until(0.0129999, 1e-3), 12u);
  EXPECT_EQ(steps_until(-1, 1e-3), 0u);
  EXPECT_GT(steps_until(1e300, 1e-3), 1'000'000'000'000'000u);
}

TEST_F(InputLogs, the_first_step_that_differs_is_named) {
  record(600, [](StepRecord& record) {
    if (record.step >= 130) record.packets[0].samples[0].pose_world.position_m.z() -= 0.0005;
  });
  // Positions are compared every kStatesHashedEvery steps.
  EXPECT_EQ(again().difference, "step 192: the positions before it differ");
  record(600, [](StepRecord& record) {
    if (record.step == 450) ++record.hash_before;
  });
  EXPECT_EQ(again().difference, "step 450: the topology before it differs");
}

TEST_F(InputLogs, every_prefix_of_a_file_is_read_as_far_as_it_is_whole) {
  record(400);
  const auto size = std::filesystem::file_size(path);
  std::uint64_t before = 399;
  for (const std::uint64_t cut : {size - 1, size - 30, size / 2, size / 7}) {
    std::filesystem::resize_file(path, cut);
    InputLogReader reader(path);
    std::uint64_t steps = 0;
    while (const auto inputs = reader.next()) ASSERT_EQ(inputs->steps.front().step, ++steps);
    EXPECT_LE(steps, before);
    EXPECT_FALSE(reader.damage().empty());
    EXPECT_LE(reader.whole_bytes(), cut);
    EXPECT_FALSE(reader.next());
    before = steps;
  }
  InputLogReader reader(path);
  while (reader.next()) {
  }
  InputLog log(path, reader.whole_bytes());
  EXPECT_EQ(std::filesystem::file_size(path), reader.whole_bytes()) << "what is torn is cut off";
  ASSERT_FALSE(log.read_from(1, 1 << 20).empty());
}

TEST_F(InputLogs, the_end_that_a_crash_leaves_is_told_from_damage) {
  record(400);
  const std::string whole = bytes();
  std::vector<std::size_t> begins;
  InputLogReader reader(path);
  do begins.push_back(reader.whole_bytes());
  while (reader.next());
  ASSERT_EQ(begins.size(), 401u);
  EXPECT_EQ(begins.back(), whole.size());
  EXPECT_FALSE(reader.is_torn()) << "it is whole";
  for (std::size_t size = begins[399] + 1; size < whole.size(); ++size)
    EXPECT_TRUE(is_torn(whole.substr(0, size))) << size;
  EXPECT_TRUE(is_torn(whole + std::string(5000, '\0')));
  for (std::size_t at = begins[20]; at < begins[21]; ++at)
    for (const int bit : {1, 128}) {
      std::string flipped = whole;
      flipped[at] = static_cast<char>(flipped[at] ^ bit);
      EXPECT_FALSE(is_torn(flipped)) << at;
    }
}

TEST_F(InputLogs, steps_are_served_from_any_step_on_while_the_file_grows) {
  record(600);
  InputLogReader reader(path);
  while (reader.next()) {
  }
  InputLog log(path, reader.whole_bytes());
  for (const std::uint64_t first : {1u, 2u, 255u, 256u, 257u, 599u, 600u}) {
    const auto records = log.read_from(first, 1000);
    ASSERT_FALSE(records.empty()) << first;
    EXPECT_EQ(records.front().step, first);
    for (std::size_t i = 1; i < records.size(); ++i) ASSERT_EQ(records[i].step, records[i - 1].step + 1);
  }
  EXPECT_TRUE(log.read_from(601, 1000).empty());
  StepRecord next;
  next.step = 601;
  EXPECT_EQ(log.append({8, 600, {next}}), std::nullopt);
  EXPECT_EQ(log.read_from(601, 1000).size(), 1u);
}

}  // namespace
}  // namespace sectio::test
