#include "common/core/number_table.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace sectio::core_test {
namespace {

TEST(NumberTable, has_what_a_map_has) {
  test::Random64 random(7);
  std::uniform_int_distribution<std::uint64_t> number(0, 5000);
  std::map<std::uint64_t, int> map;
  NumberTable<int> table;
  for (int k = 0; k < 20000; ++k) {
    const std::uint64_t n = number(random) << 32 | number(random) % 3;  // like pairs of numbers
    const bool is_new = map.try_emplace(n, k).second;
    const auto [value, was_new] = table.insert(n);
    ASSERT_EQ(was_new, is_new);
    if (is_new) {
      EXPECT_EQ(value, 0);
      value = k;
    }
    EXPECT_EQ(table.at(n), map.at(n));
  }
  for (std::uint64_t n = 0; n < 5000; ++n) EXPECT_EQ(table.contains(n << 32), map.contains(n << 32));
}

TEST(NumberTable, an_empty_one_has_nothing) {
  const NumberTable<int> table;
  EXPECT_EQ(table.find(0), nullptr);
  NumberSet set;
  EXPECT_FALSE(set.contains(3));
  EXPECT_TRUE(set.insert(3));
  EXPECT_FALSE(set.insert(3));
  EXPECT_TRUE(set.contains(3));
}

}  // namespace
}  // namespace sectio::core_test
