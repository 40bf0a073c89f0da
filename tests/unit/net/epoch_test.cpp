#include "common/messages/epoch.h"

#include <gtest/gtest.h>

#include <set>

namespace sectio::net_test {
namespace {

// Two servers, or a server and its standby, are often started in the same moment.
TEST(Epoch, differs_for_each_session_that_begins_in_one_moment) {
  std::set<std::uint64_t> names;
  for (std::uint8_t i = 0; i < 16; ++i) names.insert(name_of_session(new_epoch({i})));
  EXPECT_GT(names.size(), 14u);
}

TEST(Epoch, tells_the_program_that_has_begun_its_session) {
  const std::uint64_t epoch = next_term(new_epoch({1, 2, 3}));
  EXPECT_TRUE(has_begun({1, 2, 3}, epoch));
  EXPECT_FALSE(has_begun({1, 2, 4}, epoch));
}

TEST(Epoch, of_a_session_that_is_sought_through_all_day_stays_its_own) {
  const std::uint64_t begun = new_epoch({1});
  std::uint64_t epoch = begun;
  for (int i = 0; i < 100'000; ++i) {
    const std::uint64_t next = next_term(epoch);
    ASSERT_TRUE(takes_over(next, epoch)) << i;
    epoch = next;
  }
  EXPECT_TRUE(same_session(epoch, begun));
}

}  // namespace
}  // namespace sectio::net_test
