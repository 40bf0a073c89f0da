#include "common/core/log.h"

#include <gtest/gtest.h>

namespace sectio::core_test {
namespace {

TEST(Log, one_line_a_message_on_standard_error_with_the_programs_name) {
  set_log_program("tester");
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  log_info("ready");
  log_warning("two\nlines {} %v");
  log_error("bad");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "") << "it is for results";
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "tester: ready\ntester: warning: two lines {} %v\ntester: error: bad\n");
}

TEST(Log, messages_below_the_level_are_left_out) {
  set_log_program("tester");
  testing::internal::CaptureStderr();
  set_log_level(LogLevel::warning);
  log_info("quiet");
  log_warning("loud");
  set_log_level(LogLevel::info);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "tester: warning: loud\n");
}

TEST(Log, limited_lines_pass_once_per_key) {
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) log_limited(LogLevel::warning, "test.a", "again");
  log_limited(LogLevel::warning, "test.b", "other");
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_NE(text.find("other"), std::string::npos);
  EXPECT_EQ(text.find("again"), text.rfind("again")) << text;
}

TEST(RateLimit, counts_what_it_holds_back) {
  RateLimit limit(1.0);
  EXPECT_EQ(limit.pass("a", 10.0), 0U);
  EXPECT_EQ(limit.pass("a", 10.5), std::nullopt);
  EXPECT_EQ(limit.pass("b", 10.5), 0U);
  EXPECT_EQ(limit.pass("a", 10.9), std::nullopt);
  EXPECT_EQ(limit.pass("a", 11.0), 2U);
  EXPECT_EQ(limit.pass("a", 12.5), 0U);
}

}  // namespace
}  // namespace sectio::core_test
