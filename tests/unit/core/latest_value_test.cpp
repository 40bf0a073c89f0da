#include "common/core/latest_value.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace sectio::core_test {
namespace {

TEST(LatestValue, nothing_before_the_first_store) {
  LatestValue<int> slot;
  int value = 7;
  EXPECT_FALSE(slot.load(value));
  EXPECT_EQ(value, 7);
}

TEST(LatestValue, only_the_newest_and_only_once) {
  LatestValue<int> slot;
  slot.store(1);
  slot.store(2);
  int value = 0;
  EXPECT_TRUE(slot.load(value));
  EXPECT_EQ(value, 2);
  EXPECT_FALSE(slot.load(value));
  slot.store(3);
  EXPECT_TRUE(slot.load(value));
  EXPECT_EQ(value, 3);
}

// Every field holds the same number: a torn value would show.
TEST(LatestValue, two_threads_never_see_a_torn_or_older_value) {
  using Wide = std::array<std::uint64_t, 32>;
  constexpr std::uint64_t kLast = 200'000;
  LatestValue<Wide> slot;
  std::thread producer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      Wide value;
      value.fill(i);
      slot.store(value);
    }
  });
  std::uint64_t newest = 0;
  std::uint64_t torn = 0;
  std::uint64_t backwards = 0;
  Wide value{};
  while (newest < kLast) {
    if (!slot.load(value)) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t field : value) torn += field != value[0];
    backwards += value[0] <= newest;
    newest = value[0];
  }
  producer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(backwards, 0U);
}

}  // namespace
}  // namespace sectio::core_test
