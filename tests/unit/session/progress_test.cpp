#include "sim_server/session/progress.h"

#include <gtest/gtest.h>

namespace sectio::session_test {
namespace {

TEST(Progress, an_endless_run_has_no_last_step) {
  StepOutput output;
  output.step = 120;
  output.sim_time_s = 0.12;
  EXPECT_EQ(progress_line(output, 6500), "step 120 of 6500, 0.12 s simulated, 0 cuts");
  EXPECT_EQ(progress_line(output, std::nullopt), "step 120, 0.12 s simulated, 0 cuts");
}

}  // namespace
}  // namespace sectio::session_test
