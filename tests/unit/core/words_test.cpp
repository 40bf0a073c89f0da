#include "common/core/words.h"

#include <gtest/gtest.h>

namespace sectio::core_test {
namespace {

TEST(Words, a_finite_number_is_all_of_a_text) {
  EXPECT_EQ(finite_number("-0.25"), -0.25);
  EXPECT_EQ(finite_number("+1e-3"), 1e-3);
  EXPECT_EQ(finite_number(".5"), 0.5);
  for (const char* text : {"", "+", "+-1", "0,25", "1 ", "0.1m", "1d-1", "0x10", "nan", "inf", "1e999"})
    EXPECT_FALSE(finite_number(text)) << text;
}

TEST(Words, a_quoted_text_is_one_short_line) {
  EXPECT_EQ(shortened("a\tb\n"), "a b ");
  EXPECT_EQ(shortened(std::string(50, 'x'), 10), "xxxxxxx...");
  EXPECT_EQ(shortened(std::string(10, 'x'), 10), "xxxxxxxxxx");
}

TEST(Words, the_nearest_is_found_when_it_may_be_meant) {
  EXPECT_EQ(nearest_word("colors", {"pose", "colours"}), "colours");
  EXPECT_EQ(nearest_word("--offlin", {"--scene", "--offline"}), "--offline");
  EXPECT_EQ(nearest_word("gravity", {"pose", "colours"}), "");
  EXPECT_EQ(nearest_word("", {"a"}), "");
}

}  // namespace
}  // namespace sectio::core_test
