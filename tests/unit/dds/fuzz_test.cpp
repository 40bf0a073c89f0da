// Damaged bytes: flipped, cut, lengthened. A reader says no or gets a message that validation accepts or refuses;
// nothing crashes, and nothing is larger than the bytes justify.
#include <gtest/gtest.h>

#include <random>

#include "common/dds/convert.h"
#include "common/dds/endpoint.h"
#include "common/messages/chunks.h"
#include "tests/support/damage.h"
#include "tests/unit/dds/messages.h"

namespace sectio {
namespace {

using namespace test;

// How many of the damaged messages were taken for whole.
template <class Wire>
int survivors(const Wire& message, int count) {
  std::mt19937 random(20240613);
  const std::vector<std::uint8_t> whole = encode(message);
  int accepted = 0;
  for (int i = 0; i < count; ++i) {
    Wire m;
    if (decode(damaged(whole, random), m) && from_wire(m).has_value()) ++accepted;
  }
  return accepted;
}

TEST(Fuzz, damaged_messages_of_every_kind_are_refused_or_harmless) {
  constexpr int kCount = 5000;
  EXPECT_LT(survivors(to_wire(some_packet()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_model(), 7), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_delta()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_chunk()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(KeyframeRequest{7, 1, 5, 9}), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_header()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_piece()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_scene()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_event()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_status()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(some_end()), kCount), kCount);
  EXPECT_LT(survivors(to_wire(GravityRequest{7, Vec3(3, 0, -9)}), kCount), kCount);
}

TEST(Fuzz, a_length_that_lies_allocates_nothing) {
  std::vector<std::uint8_t> bytes = encode(to_wire(some_chunk()));
  const std::size_t length_at = bytes.size() - some_chunk().bytes.size() - 4;
  for (std::size_t i = 0; i < 4; ++i) bytes[length_at + i] = 0xff;
  wire::KeyframeChunk m;
  EXPECT_FALSE(decode(bytes, m));
  EXPECT_LT(m.bytes().capacity(), 1024u);
}

TEST(Fuzz, samples_beyond_the_size_of_their_topic_are_not_even_read) {
  wire::Event m;
  EXPECT_FALSE(decode(std::vector<std::uint8_t>(1 << 20), m));
}

TEST(Chunks, come_together_in_any_order_and_only_whole) {
  std::mt19937 random(3);
  std::vector<std::uint8_t> bytes(100'001);
  for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
  std::vector<KeyframeChunk> chunks = split_keyframe(7, 1, 5, bytes, kChunkBytesOffHost);
  std::shuffle(chunks.begin(), chunks.end(), random);
  KeyframeAssembler assembler;
  for (std::size_t i = 0; i + 1 < chunks.size(); ++i) {
    ASSERT_TRUE(from_wire(to_wire(chunks[i])));
    EXPECT_FALSE(assembler.add(chunks[i]));
    EXPECT_FALSE(assembler.add(chunks[i]));  // twice
  }
  const auto whole = assembler.add(chunks.back());
  ASSERT_TRUE(whole);
  EXPECT_EQ(*whole, bytes);
}

TEST(Chunks, of_another_revision_begin_anew) {
  const std::vector<std::uint8_t> bytes(2 * kChunkBytes, 1);
  const auto old_chunks = split_keyframe(7, 1, 5, bytes, kChunkBytes);
  const auto new_chunks = split_keyframe(7, 1, 6, bytes, kChunkBytes);
  KeyframeAssembler assembler;
  EXPECT_FALSE(assembler.add(old_chunks[0]));
  EXPECT_FALSE(assembler.add(new_chunks[1]));
  EXPECT_TRUE(assembler.add(new_chunks[0]));
}

}  // namespace
}  // namespace sectio
