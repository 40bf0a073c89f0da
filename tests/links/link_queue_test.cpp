// The switch's own arithmetic.
#include "tests/support/link_queue.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace sectio::test {
namespace {

EthernetFrame frame(std::size_t bytes, std::uint8_t mark, std::uint8_t service = 0) {
  EthernetFrame f(bytes, mark);
  f[12] = 0x08;
  f[13] = 0x00;
  f[15] = service;
  return f;
}

TEST(LinkQueue, a_rate_makes_frames_wait_and_a_full_queue_drops_them) {
  LinkQueue link({.rate_bit_per_s = 8e6, .queue_bytes = 5000});  // a megabyte a second
  for (int i = 0; i < 10; ++i) link.offer(frame(1000, static_cast<std::uint8_t>(i)), 0);
  EthernetFrame f;
  EXPECT_FALSE(link.take(0.0009, f));
  ASSERT_TRUE(link.take(0.00101, f));
  EXPECT_EQ(f[0], 0);
  int more = 0;
  for (; link.take(1, f); ++more) {
  }
  EXPECT_EQ(more, 5) << "one was being sent, and five waited";
  EXPECT_EQ(link.traffic().dropped, 4u);
  EXPECT_EQ(link.traffic().bytes, 10'000u);
}

TEST(LinkQueue, expedited_frames_overtake_those_that_wait) {
  LinkQueue link({.rate_bit_per_s = 8e6});
  for (int i = 0; i < 3; ++i) link.offer(frame(1000, 1), 0);
  link.offer(frame(100, 2, 46 << 2), 0);
  EthernetFrame f;
  ASSERT_TRUE(link.take(0.0011, f));
  EXPECT_EQ(f[0], 1) << "it was being sent already";
  ASSERT_TRUE(link.take(0.0012, f));
  EXPECT_EQ(f[0], 2);
}

TEST(LinkQueue, delay_jitter_and_order) {
  for (const bool reorders : {false, true}) {
    LinkQueue link({.delay_s = 0.025, .jitter_s = 0.01, .reorders = reorders});
    for (int i = 0; i < 100; ++i) link.offer(frame(60, static_cast<std::uint8_t>(i)), 1e-3 * i);
    EthernetFrame f;
    EXPECT_FALSE(link.take(0.0149, f));
    std::vector<int> order;
    while (link.take(1, f)) order.push_back(f[0]);
    EXPECT_EQ(order.size(), 100u);
    EXPECT_EQ(std::is_sorted(order.begin(), order.end()), !reorders);
  }
}

TEST(LinkQueue, loses_as_often_as_it_should) {
  LinkQueue link({.loss = 0.05});
  EthernetFrame f;
  for (int i = 0; i < 10'000; ++i) link.offer(frame(60, 0), 1e-3 * i);
  EXPECT_NEAR(static_cast<double>(link.traffic().lost), 500, 100);
}

}  // namespace
}  // namespace sectio::test
