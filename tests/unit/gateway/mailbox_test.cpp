#include "render_client/gateway/mailbox.h"

#include <gtest/gtest.h>

namespace sectio::gateway_test {
namespace {

SharedBytes some(std::size_t size, std::uint8_t value = 0) {
  return std::make_shared<const std::vector<std::uint8_t>>(size, value);
}

// The first byte of each message that is taken until nothing waits, by kind.
std::vector<std::pair<LiveKind, int>> all_of(Mailbox& mailbox) {
  std::vector<std::pair<LiveKind, int>> taken;
  for (std::vector<std::uint8_t> frame; mailbox.take(frame);) {
    LiveFrameReader reader(frame);
    while (const auto message = reader.next()) taken.emplace_back(message->kind, message->bytes[0]);
    EXPECT_FALSE(reader.damaged());
  }
  return taken;
}

TEST(Mailbox, changes_of_topology_come_in_order_and_before_states) {
  Mailbox mailbox;
  mailbox.post_newest({LiveKind::state_header, 7}, some(10, 1));
  mailbox.post(LiveKind::delta, some(10, 2));
  mailbox.post(LiveKind::delta, some(10, 3));
  EXPECT_EQ(all_of(mailbox), (std::vector<std::pair<LiveKind, int>>{
                                 {LiveKind::delta, 2}, {LiveKind::delta, 3}, {LiveKind::state_header, 1}}));
  EXPECT_TRUE(mailbox.is_empty());
}

TEST(Mailbox, the_newest_state_wins) {
  Mailbox mailbox;
  for (std::uint8_t i = 0; i < 100; ++i) {
    mailbox.post_newest({LiveKind::state_header, 7}, some(10, i));
    mailbox.post_newest({LiveKind::state_piece, 7, 0, 3}, some(10, i));
    mailbox.post_newest({LiveKind::contact, 7, 1}, some(10, i));
  }
  EXPECT_EQ(all_of(mailbox), (std::vector<std::pair<LiveKind, int>>{
                                 {LiveKind::state_header, 99}, {LiveKind::state_piece, 99}, {LiveKind::contact, 99}}));
  EXPECT_EQ(mailbox.replaced(), 99u) << "states, however many pieces each has";
}

// A client that takes one frame while a whole new state comes still gets every piece again and again.
TEST(Mailbox, no_piece_of_a_body_starves) {
  Mailbox mailbox;
  constexpr std::uint32_t kPieces = 200;
  std::vector<int> seen(kPieces, 0);
  for (int round = 0; round < 100; ++round) {
    for (std::uint32_t p = 0; p < kPieces; ++p)
      mailbox.post_newest({LiveKind::state_piece, 7, 0, p}, some(1200, static_cast<std::uint8_t>(p)));
    std::vector<std::uint8_t> frame;
    ASSERT_TRUE(mailbox.take(frame));
    EXPECT_LE(frame.size(), Mailbox::kFrameBytes);
    LiveFrameReader reader(frame);
    while (const auto message = reader.next()) ++seen[message->bytes[0]];
  }
  for (std::uint32_t p = 0; p < kPieces; ++p) EXPECT_GE(seen[p], 15) << p;
}

TEST(Mailbox, who_reads_nothing_costs_bounded_memory_and_later_asks_for_a_keyframe) {
  Mailbox mailbox;
  for (int i = 0; i < 200; ++i) mailbox.post(LiveKind::delta, some(100'000));
  EXPECT_GT(mailbox.dropped(), 0u);
  std::size_t bytes = 0;
  for (std::vector<std::uint8_t> frame; mailbox.take(frame);) bytes += frame.size();
  EXPECT_LE(bytes, Mailbox::kMaxOrderedBytes + 100'000);
  mailbox.post_keyframe(7, 1, {some(100, 1), some(100, 2)});
  EXPECT_TRUE(mailbox.holds_keyframe(7, 1));
  EXPECT_FALSE(mailbox.holds_keyframe(7, 0));
  EXPECT_EQ(all_of(mailbox).size(), 2u);
  EXPECT_FALSE(mailbox.holds_keyframe(7, 1));
}

}  // namespace
}  // namespace sectio::gateway_test
