#include "common/messages/epoch.h"

#include <gtest/gtest.h>

namespace sectio::net_test {
namespace {

TEST(Epoch, of_a_session_that_is_sought_through_all_day_stays_its_own) {
  const std::uint64_t begun = new_epoch();
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
