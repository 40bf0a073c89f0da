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
