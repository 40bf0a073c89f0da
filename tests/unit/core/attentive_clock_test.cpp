#include "common/core/attentive_clock.h"

#include <gtest/gtest.h>

namespace sectio {
namespace {

TEST(AttentiveClock, counts_little_of_a_time_in_which_nobody_looked) {
  AttentiveClock clock(0.1);
  EXPECT_EQ(clock.look(50), 0);
  EXPECT_NEAR(clock.look(50.04), 0.04, 1e-12);
  EXPECT_NEAR(clock.look(53), 0.1, 1e-12);
  clock.look(53.05);
  EXPECT_NEAR(clock.now_s(), 0.19, 1e-12);
}

}  // namespace
}  // namespace sectio
