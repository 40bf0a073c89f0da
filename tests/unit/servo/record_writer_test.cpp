#include "device_bridge/servo/record_writer.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/core/error.h"
#include "common/math/trace.h"

namespace sectio::servo_test {
namespace {

class RecordWriterTest : public testing::Test {
 protected:
  RecordWriterTest() { std::filesystem::create_directory(directory_); }
  ~RecordWriterTest() override { std::filesystem::remove_all(directory_); }
  std::string file(const std::string& name) const { return directory_ + "/" + name; }

  // The ring must hold so many ticks.
  void move(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      ServoRecord record;
      record.sample.tool_time_s = 0.001 * static_cast<double>(moved_.size());
      record.sample.pose_world = {Vec3(0.1 * i, 1.0 / 3, -1e-9), Eigen::Quaterniond(0.6, 0, 0.8, 0)};
      record.sample.opening_rad = 0.01 * i;
      record.server_silent = i == 3;
      record.overruns = static_cast<std::uint64_t>(i / 2);
      record.woke_after_s = 1.25e-4 * i;
      ASSERT_TRUE(records_.push(record));
      moved_.push_back({record.sample.tool_time_s, record.sample.pose_world, record.sample.opening_rad});
    }
  }

  std::string directory_ = testing::TempDir() + "records_" + std::to_string(getpid());
  Ring<ServoRecord> records_{1024};
  std::vector<TracePoint> moved_;
};

TEST_F(RecordWriterTest, log_and_record_are_the_motion_bit_for_bit) {
  move(5);
  testing::internal::CaptureStderr();
  RecordWriter writer(file("log.csv"), file("record.csv"));
  writer.drain(records_);
  writer.finish();
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("back"), std::string::npos);
  EXPECT_NE(said.find("silent"), std::string::npos);
  EXPECT_EQ(said.find("silent"), said.rfind("silent")) << "once";
  EXPECT_EQ(writer.written(), 5U);
  EXPECT_EQ(load_trace(file("log.csv")), moved_);
  EXPECT_EQ(load_trace(file("record.csv")), moved_);
}

TEST_F(RecordWriterTest, a_log_tells_last_when_the_loop_woke) {
  move(4);
  RecordWriter writer(file("log.csv"));
  writer.drain(records_);
  writer.finish();
  std::ifstream log(file("log.csv"));
  std::vector<std::string> ends;
  for (std::string line; std::getline(log, line);) ends.push_back(line.substr(line.rfind(',', line.rfind(',') - 1)));
  EXPECT_EQ(ends,
            (std::vector<std::string>{",overruns,woke_after_s", ",0,0", ",0,0.000125", ",1,0.00025", ",1,0.000375"}));
}

TEST_F(RecordWriterTest, an_older_file_stays_until_something_has_moved) {
  std::ofstream(file("record.csv")) << "older";
  RecordWriter writer("", file("record.csv"));
  writer.drain(records_);
  EXPECT_EQ(std::filesystem::file_size(file("record.csv")), 5U);
  move(2);
  writer.drain(records_);
  writer.finish();
  EXPECT_EQ(load_trace(file("record.csv")), moved_);
  EXPECT_THROW(RecordWriter("", "/none/record.csv"), InputError);
}

// A limit of the process stands for the disk's end, in the middle of a line.
TEST_F(RecordWriterTest, a_full_disk_is_one_warning_and_what_came_before_can_be_played) {
  RecordWriter writer("", file("record.csv"));
  move(100);
  writer.drain(records_);
  const std::vector<TracePoint> before = moved_;
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit little{std::filesystem::file_size(file("record.csv")) + 100, limit.rlim_max};
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) {
    move(100);
    writer.drain(records_);
  }
  EXPECT_THROW(writer.finish(), std::runtime_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  signal(SIGXFSZ, handler);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("the disk takes no more"), std::string::npos) << said;
  EXPECT_EQ(said.find("the disk takes no more"), said.rfind("the disk takes no more"));
  EXPECT_EQ(load_trace(file("record.csv")), before);
}

}  // namespace
}  // namespace sectio::servo_test
