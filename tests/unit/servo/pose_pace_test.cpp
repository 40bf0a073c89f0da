#include "device_bridge/net/pose_pace.h"

#include <gtest/gtest.h>

namespace sectio {
namespace {

TEST(PosePace, is_that_of_the_device_where_answers_come_promptly) {
  PosePace pace;
  EXPECT_EQ(pace.interval_s(0), PosePace::kShortest_s);
  pace.sent(0);
  pace.answered(0.01, 0.003);
  EXPECT_EQ(pace.interval_s(0.011), PosePace::kShortest_s);
}

TEST(PosePace, grows_with_the_age_of_answers_and_with_silence_to_a_bound) {
  PosePace pace;
  pace.sent(0);
  EXPECT_NEAR(pace.interval_s(0.13), 0.01, 1e-9) << "nobody has answered";
  EXPECT_EQ(pace.interval_s(10), PosePace::kLongest_s);
  pace.answered(10, 0.2);
  EXPECT_NEAR(pace.interval_s(10.001), 0.125 * 0.15, 1e-9);
  pace.answered(10.1, 0.01);
  EXPECT_EQ(pace.interval_s(10.1), PosePace::kShortest_s) << "at once";
}

TEST(PosePace, poses_that_are_left_out_make_no_hole_and_holes_stay) {
  std::vector<FreshPose> poses(25);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].sample.tool_time_s = 0.001 * static_cast<double>(i);
  const auto all_go_on = [](const std::vector<FreshPose>& some) {
    return std::ranges::all_of(some, &FreshPose::goes_on);
  };
  std::vector<FreshPose> four = evenly(poses, 4);
  ASSERT_EQ(four.size(), 4u);
  EXPECT_EQ(four.back().sample.tool_time_s, poses.back().sample.tool_time_s) << "the newest";
  for (std::size_t i = 1; i < 4; ++i)
    EXPECT_NEAR(four[i].sample.tool_time_s - four[i - 1].sample.tool_time_s, 0.00625, 0.001);
  EXPECT_TRUE(all_go_on(four));
  for (std::size_t hole = 0; hole < poses.size(); ++hole) {
    std::vector<FreshPose> torn = poses;
    torn[hole].goes_on = false;
    EXPECT_FALSE(all_go_on(evenly(torn, 4))) << hole;
  }
}

// A queue of 64 kB before a link of 256 kbit/s, in which packets of half a kilobyte wait.
TEST(PosePace, a_thin_link_comes_to_answers_that_are_felt) {
  constexpr double kPacket_kbit = 4, kLink_kbit_per_s = 256, kQueue_kbit = 512;
  PosePace pace;
  double queue_kbit = 0, last_s = 0, age_s = 0;
  pace.sent(0);
  for (int ms = 1; ms < 20000; ++ms) {
    const double now_s = 0.001 * ms;
    queue_kbit = std::max(0.0, queue_kbit - 0.001 * kLink_kbit_per_s);
    if (now_s - last_s >= pace.interval_s(now_s) && queue_kbit + kPacket_kbit <= kQueue_kbit) {
      queue_kbit += kPacket_kbit;
      last_s = now_s;
    }
    age_s = queue_kbit / kLink_kbit_per_s + 0.02;
    pace.answered(now_s, age_s);
  }
  EXPECT_LT(age_s, 0.25);
}

}  // namespace
}  // namespace sectio
