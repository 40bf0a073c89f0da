#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "common/core/error.h"
#include "common/mcap/mcap_reader.h"
#include "common/mcap/mcap_writer.h"
#include "tests/support/flip_file.h"
#include "tests/support/random.h"

namespace sectio::mcap_test {
namespace {

class Mcap : public testing::Test {
 protected:
  ~Mcap() override { std::filesystem::remove(path); }

  // Two topics in turn, in chunks of a few messages.
  void write(std::uint64_t messages) {
    McapWriter writer(path, 400);
    writer.add_metadata("sectio", {{"session", "theatre"}, {"empty", ""}});
    const auto numbers = writer.add_channel("numbers", "sectio::Number", "struct Number { octet n[3]; };");
    const auto others = writer.add_channel("others", "sectio::Other", "");
    for (std::uint64_t i = 0; i < messages; ++i) {
      EXPECT_TRUE(writer.add(numbers, 1000 * i, content(i)));
      EXPECT_TRUE(writer.add(others, 1000 * i, {}));
    }
    EXPECT_TRUE(writer.finish());
  }
  static std::vector<std::uint8_t> content(std::uint64_t i) {
    return std::vector<std::uint8_t>(i % 50, static_cast<std::uint8_t>(i));
  }
  // Reads all; each message must be the one that was written.
  std::uint64_t read(McapReader& reader) {
    std::uint64_t count = 0;
    while (const auto message = reader.next("numbers")) {
      EXPECT_EQ(message->time_ns, 1000 * count);
      EXPECT_EQ(message->bytes, content(count));
      ++count;
    }
    return count;
  }

  void flip(std::uint64_t byte, int bit) const { test::flip(path, byte, 1 << bit); }
  std::vector<McapReader::Chunk> chunks() const {
    McapReader reader(path);
    std::vector<McapReader::Chunk> all;
    while (const auto chunk = reader.next_chunk()) {
      all.push_back(*chunk);
      std::ranges::sort(all.back().topics);
    }
    return all;
  }

  std::string path = testing::TempDir() + "sectio_" + std::to_string(getpid()) + ".mcap";
};

TEST_F(Mcap, a_file_stays_as_it_was_until_there_is_something_to_write) {
  write(10);
  const auto bytes = std::filesystem::file_size(path);
  {
    McapWriter writer(path);
    writer.add_metadata("sectio", {{"session", "another"}});
    EXPECT_THROW(McapWriter{path}, InputError) << "two write there";
  }
  EXPECT_EQ(std::filesystem::file_size(path), bytes);
  McapReader reader(path);
  EXPECT_EQ(read(reader), 10u);
  std::filesystem::remove(path);
  { const McapWriter writer(path); }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(Mcap, brings_back_what_was_written_in_order) {
  write(1000);
  EXPECT_TRUE(is_mcap(path));
  McapReader reader(path);
  EXPECT_EQ(read(reader), 1000u);
  EXPECT_TRUE(reader.is_finished());
  EXPECT_EQ(reader.metadata().at("sectio").at("session"), "theatre");
  McapReader other(path);
  std::uint64_t count = 0;
  while (other.next("others")) ++count;
  EXPECT_EQ(count, 1000u);
}

TEST_F(Mcap, chunks_are_found_by_their_heads_and_lead_to_their_messages) {
  write(1000);
  McapReader reader(path);
  std::vector<McapReader::Chunk> chunks;
  while (const auto chunk = reader.next_chunk()) {
    ASSERT_EQ(chunk->topics.size(), 2u);
    chunks.push_back(*chunk);
  }
  EXPECT_TRUE(reader.is_finished());
  ASSERT_GT(chunks.size(), 20u);
  EXPECT_EQ(chunks.back().last_ns, 999'000u);
  McapReader other(path);  // has read nothing before
  std::vector<McapReader::Chunk> some;
  for (int i = 0; i < 20; ++i) some.push_back(*other.next_chunk());
  for (int i = 19; i >= 0; --i) {
    other.go_to(some[static_cast<std::size_t>(i)].place);
    const auto message = other.next();
    ASSERT_TRUE(message);
    EXPECT_EQ(message->time_ns, some[static_cast<std::size_t>(i)].first_ns);
  }
}

// The head of a chunk has 53 bytes; its index follows.
TEST_F(Mcap, chunks_behind_any_flipped_bit_are_found_and_tell_their_topics) {
  write(200);
  const std::vector<McapReader::Chunk> whole = chunks();
  ASSERT_GT(whole.size(), 5u);
  for (const std::size_t damaged : {0u, 2u})
    for (std::uint64_t byte = whole[damaged].place; byte < whole[damaged + 1].place; ++byte)
      for (const int bit : {0, 3, 7}) {
        flip(byte, bit);
        const std::vector<McapReader::Chunk> found = chunks();
        std::size_t missing = 0;
        for (std::size_t i = 0; i < whole.size(); ++i) {
          if (i == damaged) continue;
          const auto same = std::ranges::find(found, whole[i].place, &McapReader::Chunk::place);
          if (same == found.end() || same->topics != whole[i].topics) ++missing;
        }
        ASSERT_EQ(missing, 0u) << "byte " << byte - whole[damaged].place << " of chunk " << damaged << ", bit " << bit;
        McapReader reader(path);
        reader.go_to(whole[damaged + 1].place);
        const auto message = reader.next();
        ASSERT_TRUE(message);
        ASSERT_FALSE(message->topic.empty());
        flip(byte, bit);
      }
}

TEST_F(Mcap, of_every_prefix_what_is_whole_is_read) {
  write(200);
  std::uint64_t before = 200;
  for (auto size = std::filesystem::file_size(path) - 1; size > 8; size -= std::min<std::uintmax_t>(size, 37)) {
    std::filesystem::resize_file(path, size);
    McapReader reader(path);
    const std::uint64_t count = read(reader);
    ASSERT_LE(count, before);
    ASSERT_LE(reader.at(), size);
    before = count;
  }
  EXPECT_EQ(before, 0u);
  std::filesystem::resize_file(path, 5);
  EXPECT_THROW(McapReader{path}, InputError);
}

TEST_F(Mcap, a_damaged_byte_never_yields_a_message_that_was_not_written) {
  write(100);
  const auto size = std::filesystem::file_size(path);
  test::Random random(7);
  for (int i = 0; i < 2000; ++i) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    const auto at = static_cast<std::streamoff>(8 + random() % (size - 8));
    file.seekg(at);
    const int byte = file.get();
    file.seekp(at);
    file.put(static_cast<char>(random()));
    file.close();
    McapReader reader(path);
    std::uint64_t last = 0;
    while (const auto message = reader.next("numbers")) {  // a chunk whose kind is damaged is a hole
      ASSERT_GE(message->time_ns, last);
      ASSERT_EQ(message->bytes, content(message->time_ns / 1000)) << "byte " << at << " was damaged";
      last = message->time_ns + 1;
    }
    file.open(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(at);
    file.put(static_cast<char>(byte));
  }
}

TEST_F(Mcap, takes_the_place_of_an_earlier_record_and_of_nothing_else) {
  write(3);
  write(2);
  McapReader again(path);
  EXPECT_EQ(read(again), 2u);
  std::filesystem::resize_file(path, 4);  // no record any more
  EXPECT_THROW(McapWriter writer(path), InputError);
  EXPECT_EQ(std::filesystem::file_size(path), 4u);
}

}  // namespace
}  // namespace sectio::mcap_test
