// Damaged bytes: flipped, cut, lengthened. decode() refuses them or returns a valid message; nothing crashes, and
// nothing is larger than the bytes justify.
#include <gtest/gtest.h>

#include "common/messages/chunks.h"
#include "common/messages/codec.h"
#include "common/messages/session_fields.h"
#include "common/messages/state_fields.h"
#include "common/messages/tool_fields.h"
#include "common/messages/topology_fields.h"
#include "common/messages/validate.h"
#include "tests/support/damage.h"
#include "tests/support/random.h"
#include "tests/unit/dds/messages.h"

namespace sectio::dds_test {
namespace {

using namespace test;

TEST(Fuzz, damaged_messages_of_every_kind_are_refused_or_valid) {
  constexpr int kCount = 5000;
  for_each_message([&](const auto& message) {
    using Message = std::decay_t<decltype(message)>;
    test::Random random(20240613);
    const std::vector<std::uint8_t> whole = encode(message);
    int refused = 0;
    for (int i = 0; i < kCount; ++i) {
      const std::optional<Message> survivor = decode<Message>(damaged(whole, random));
      if (!survivor) ++refused;
      EXPECT_TRUE(!survivor || first_flaw(*survivor).empty());
    }
    EXPECT_GT(refused, kCount / 10) << whole.size() << " bytes";
  });
}

TEST(Fuzz, a_message_that_ends_too_early_is_refused_wherever_it_ends) {
  for_each_message([&](const auto& message) {
    using Message = std::decay_t<decltype(message)>;
    std::vector<std::uint8_t> bytes = encode(message);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      ASSERT_FALSE(decode<Message>(std::span(bytes).first(size))) << size << " of " << bytes.size();
    bytes.insert(bytes.end(), 3, 0);  // a carrier may align what it carries
    EXPECT_TRUE(decode<Message>(bytes));
    bytes.push_back(0);
    EXPECT_FALSE(decode<Message>(bytes));
  });
}

// Every word of a message in turn says that there are four thousand million of something. A machine without memory for
// so many would end here.
TEST(Fuzz, a_count_that_lies_allocates_nothing) {
  for_each_message([&](const auto& message) {
    using Message = std::decay_t<decltype(message)>;
    const std::vector<std::uint8_t> whole = encode(message);
    for (std::size_t word = 4; word + 4 <= whole.size(); word += 4) {
      std::vector<std::uint8_t> bytes = whole;
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(word), 4, std::uint8_t{0xff});
      const auto survivor = decode<Message>(bytes);
      EXPECT_TRUE(!survivor || first_flaw(*survivor).empty()) << word;
    }
  });
}

TEST(Chunks, come_together_in_any_order_and_only_whole) {
  test::Random random(3);
  std::vector<std::uint8_t> bytes(100'001);
  for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
  std::vector<KeyframeChunk> chunks = split_keyframe(7, 1, 5, bytes, kChunkBytesOffHost);
  std::shuffle(chunks.begin(), chunks.end(), random);
  KeyframeAssembler assembler;
  for (std::size_t i = 0; i + 1 < chunks.size(); ++i) {
    ASSERT_EQ(first_flaw(chunks[i]), "");
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
}  // namespace sectio::dds_test
