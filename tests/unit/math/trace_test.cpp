#include "common/math/trace.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <regex>

#include "common/core/error.h"

namespace sectio::math_test {
namespace {

class Trace : public testing::Test {
 protected:
  std::string write(const std::string& text) const {
    std::ofstream(path_) << text;
    return path_;
  }
  void TearDown() override { std::filesystem::remove(path_); }

  std::string path_ = testing::TempDir() + "trace_" + std::to_string(getpid()) + ".csv";
};

const std::string kHeader = "time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz\n";

TEST_F(Trace, reads_columns_by_name_in_any_order) {
  const auto trace =
      load_trace(write("# a comment\nqw,qx,qy,qz,force_n,time_s,x_world_m,y_world_m,z_world_m\r\n"
                       "1,0,0,0,9,0.5,1,2,3\r\n\r\n0,1,0,0,9,1.5,3,2,1\n"));
  ASSERT_EQ(trace.size(), 2U);
  EXPECT_EQ(trace[0].time_s, 0.5);
  EXPECT_EQ(trace[1].pose_world.position_m, Vec3(3, 2, 1));
  EXPECT_EQ(trace[1].pose_world.orientation.x(), 1);
}

TEST_F(Trace, interpolates_and_rests_at_the_ends) {
  const auto trace = load_trace(write(kHeader + "1,0,0,0,1,0,0,0\n3,2,4,6,0,0,0,1\n"));
  EXPECT_EQ(pose_at(trace, 0).position_m, Vec3(0, 0, 0));
  EXPECT_TRUE(pose_at(trace, 2).position_m.isApprox(Vec3(1, 2, 3)));
  EXPECT_NEAR(pose_at(trace, 2).orientation.z(), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(pose_at(trace, 3).position_m, Vec3(2, 4, 6));
  EXPECT_EQ(pose_at(trace, 9).position_m, Vec3(2, 4, 6));
}

TEST_F(Trace, the_opening_of_a_joint_is_a_column_that_need_not_be) {
  const auto trace = load_trace(write("opening_rad," + kHeader + "0.4,1,0,0,0,1,0,0,0\n0.2,3,0,0,0,1,0,0,0\n"));
  EXPECT_EQ(trace[0].opening_rad, 0.4);
  EXPECT_NEAR(point_at(trace, 2).opening_rad, 0.3, 1e-12);
  EXPECT_EQ(point_at(trace, 9).opening_rad, 0.2);
  EXPECT_EQ(load_trace(write(kHeader + "1,0,0,0,1,0,0,0\n"))[0].opening_rad, 0);
}

TEST_F(Trace, what_is_written_is_read_back_bit_for_bit) {
  std::vector<TracePoint> trace;
  for (int i = 0; i < 100; ++i) {
    const Eigen::AngleAxisd turn(0.1 * i, Vec3(1, 2, 3).normalized());
    trace.push_back({0.001 * i, {Vec3(1.0 / (3 + i), -1e-9 * i, 0.1), Eigen::Quaterniond(turn)}, 0.01 * i});
  }
  std::string text = trace_columns() + '\n';
  for (const TracePoint& point : trace) {
    append_trace_point(text, point);
    text += '\n';
  }
  EXPECT_EQ(load_trace(write(text)), trace);
}

TEST_F(Trace, a_spreadsheet_may_have_written_it) {
  const std::string text = kHeader + "0,0,0,0,1,0,0,0\n1,0,0,2,1,0,0,0\n";
  EXPECT_EQ(load_trace(write("\xef\xbb\xbf" + std::regex_replace(text, std::regex("\n"), "\r\n"))),
            load_trace(write(text)));
}

TEST_F(Trace, names_and_numbers_may_stand_in_quotes_and_numbers_behind_a_plus) {
  EXPECT_EQ(load_trace(write(
                "\"\", \"time_s\",\"x_world_m\",y_world_m,z_world_m,qw,qx,qy,qz\n\"1\",+0.5,\"1\",2,3,1,0,0,0\n")),
            load_trace(write(kHeader + "0.5,1,2,3,1,0,0,0\n")));
}

TEST_F(Trace, errors_name_file_line_and_column) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"time_s,x_world_m,y_world_m\n", ":1: z_world_m: column missing among time_s, x_world_m, y_world_m"},
      {"Time_s,X_world_mm\n", ":1: time_s: column missing among Time_s, X_world_mm"},
      {"time_s;x_world_m;y_world_m\n0,5;0;0\n", ":1: columns: expected commas between them, and points in numbers"},
      {"time_s\tx_world_m\ty_world_m\n", ":1: columns: expected commas between them"},
      {kHeader + "0,0,0,0,1,0,0,0\n1,0,oops,0,1,0,0,0\n", ":3: y_world_m: expected a finite number, got \"oops\""},
      {kHeader + "0,0,0,nan,1,0,0,0\n", ":2: z_world_m: "},
      {kHeader + "0,0,0,,1,0,0,0\n", ":2: z_world_m: "},
      {kHeader + "0,0,0,0,1,0,0\n", ":2: row: expected 8 columns, got 7"},
      {kHeader + "0,0,0,0,0,0,0,0\n", ":2: qw: expected a unit quaternion"},
      {kHeader + "0,0,1e30,0,1,0,0,0\n", ":2: y_world_m: expected -1000 to 1000 m"},
      {kHeader + "1,0,0,0,1,0,0,0\n1,0,0,0,1,0,0,0\n", ":3: time_s: times must ascend"},
      {"qz," + kHeader, ":1: qz: column given twice"},
      {"opening_rad,opening_rad," + kHeader, ":1: opening_rad: column given twice"},
      {"opening_rad," + kHeader + "4,0,0,0,0,1,0,0,0\n", ":2: opening_rad: expected 0 to pi"},
      {kHeader, ": no point"},
      {"", ": no point"},
  };
  for (const auto& [text, expected] : cases) {
    try {
      load_trace(write(text));
      ADD_FAILURE() << "accepted, instead of " << expected;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find(path_ + expected), 0U) << error.what();
    }
  }
  EXPECT_THROW(load_trace("/nowhere/trace.csv"), InputError);
}

TEST_F(Trace, a_directory_is_no_empty_trace) {
  try {
    load_trace(testing::TempDir());
    ADD_FAILURE() << "a directory was read";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), testing::TempDir() + ": can't be read: Is a directory");
  }
}

}  // namespace
}  // namespace sectio::math_test
