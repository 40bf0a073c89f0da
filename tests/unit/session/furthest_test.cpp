// A server goes on with one of several journals.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/mcap/mcap_writer.h"
#include "common/messages/epoch.h"
#include "sim_server/session/input_log.h"
#include "sim_server/session/run_files.h"

namespace sectio::test {
namespace {

class Journals : public testing::Test {
 protected:
  Journals() : root_(testing::TempDir() + "sectio_furthest_" + std::to_string(::getpid())) {
    std::filesystem::remove_all(root_);
  }
  ~Journals() override { std::filesystem::remove_all(root_); }

  // `moved_m`: where the hand is, so that sessions of other hands differ.
  std::string journal(const std::string& name, std::uint64_t epoch, std::uint64_t steps, double moved_m = 0) {
    const std::string directory = root_ + "/" + name;
    std::filesystem::create_directories(directory);
    InputLog log(input_log_path(directory), {"scene.yaml", {"body"}, 1});
    for (std::uint64_t step = 1; step <= steps; ++step) {
      StepRecord record;
      record.step = step;
      ToolSample sample;
      sample.sequence = step;
      sample.pose_world.position_m.x() = moved_m;
      record.packets.push_back({0, 1, {sample}});
      EXPECT_EQ(log.append({epoch, step - 1, {record}}), std::nullopt);
    }
    return directory;
  }
  static std::string best(const std::vector<std::string>& newest_first) {
    const auto furthest = furthest_unfinished(newest_first);
    return furthest
               ? std::filesystem::path(furthest->directory).filename().string() + " " + std::to_string(furthest->step)
               : "";
  }
  std::string root_;
  const std::uint64_t first_ = first_epoch(12345);
};

TEST_F(Journals, a_standby_that_had_not_caught_up_has_less_of_the_same_session) {
  const std::string whole = journal("whole", first_, 90), part = journal("part", next_term(first_), 40),
                    none = journal("none", next_term(first_), 0);
  EXPECT_EQ(best({none, part, whole}), "whole 90");
  EXPECT_EQ(best({whole, part}), "whole 90");
  EXPECT_EQ(best({none}), "");
}

TEST_F(Journals, a_newer_journal_with_other_steps_or_of_another_session_counts) {
  const std::string old = journal("old", first_, 90);
  EXPECT_EQ(best({journal("anew", next_term(first_), 40, 0.01), old}), "anew 40");
  EXPECT_EQ(best({journal("other", first_epoch(54321), 40), old}), "other 40");
}

TEST_F(Journals, a_session_that_has_ended_is_none_to_go_on_with) {
  const std::string ended = journal("ended", first_, 90);
  std::ofstream(ended + "/report.json") << "{}";
  EXPECT_EQ(best({ended}), "");
}

TEST_F(Journals, a_session_that_goes_on_has_another_record_than_before) {
  std::filesystem::create_directories(root_);
  const std::string first = root_ + "/ward.mcap";
  EXPECT_EQ(record_to_write(first, true), first);
  for (const char* next : {"/ward_2.mcap", "/ward_3.mcap"}) {
    McapWriter writer(record_to_write(first, true));
    EXPECT_TRUE(writer.add(writer.add_channel("numbers", "sectio::Number", ""), 0, {}));
    EXPECT_TRUE(writer.finish());
    EXPECT_EQ(record_to_write(first, true), root_ + next);
    EXPECT_EQ(record_to_write(first, false), std::string(next) == "/ward_2.mcap" ? first : root_ + next)
        << "a new session, beside records of one that went on";
  }
}

}  // namespace
}  // namespace sectio::test
