#include "sim_server/net/played_record.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "common/core/error.h"
#include "common/record/session_record.h"
#include "tests/support/shapes.h"

namespace sectio::net_test {
namespace {

// A minute of a body that rises by a millimetre a second, with its keyframe every ten seconds.
class PlayedRecords : public testing::Test {
 protected:
  static constexpr double kEnd_s = 60;

  PlayedRecords() {
    SessionRecord record(path, {});
    SceneInfo scene;
    scene.epoch = 4096;
    scene.session = "theatre";
    scene.step_s = 0.001;
    scene.bodies.push_back({.name = "liver"});
    scene.world_bodies = {"liver"};
    for (std::uint64_t step = 0; step <= 60000; step += 20) {
      record.set_time(1e-3 * static_cast<double>(step));
      if (step % 10000 == 0) {
        record.add(scene);
        record.add_keyframe(scene.epoch, 0, mesh);
      }
      StatePiece piece;
      piece.epoch = scene.epoch;
      piece.step = step;
      piece.revision = mesh.revision();
      piece.offsets_quanta.assign(3 * kVerticesPerPiece, static_cast<std::uint16_t>(step));
      record.add(piece);
      StateHeader header;
      header.epoch = scene.epoch;
      header.step = step;
      header.bodies.resize(1);
      record.add(header);
      if (step == 30000) middle = std::filesystem::file_size(path);
    }
  }
  ~PlayedRecords() override { std::filesystem::remove(path); }

  void damage(std::uintmax_t at) const {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(at));
    file << "damage";
  }
  void flip(std::uint64_t byte) const {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(byte));
    const int flipped = file.get() ^ 4;
    file.seekp(static_cast<std::streamoff>(byte));
    file.put(static_cast<char>(flipped));
  }
  // The places of the first chunk and of the second.
  std::pair<std::uint64_t, std::uint64_t> first_chunk() const {
    McapReader reader(path);
    const std::uint64_t begin = reader.next_chunk()->place;
    return {begin, reader.next_chunk()->place};
  }
  static double shown_s(PlayedRecord& record) { return record.world().news().sim_time_s; }

  const std::string path = testing::TempDir() + "sectio_played_" + std::to_string(getpid()) + ".mcap";
  const TriangleMesh mesh{test::box(12, 12, 12, Vec3(0.1, 0.1, 0.1))};
  std::uintmax_t middle = 0;
};

TEST_F(PlayedRecords, is_shown_from_any_moment_on) {
  PlayedRecord record(path);
  EXPECT_NEAR(record.end_s(), kEnd_s, 1e-6);
  for (const double to_s : {59.0, 0.0, 31.3, 9.99, 10.0, 60.0, 1e300}) {
    record.seek(to_s);
    EXPECT_NEAR(shown_s(record), std::min(to_s, kEnd_s), 0.03);
    EXPECT_TRUE(record.world().can_be_shown());
  }
  EXPECT_FALSE(record.is_damaged());
}

TEST_F(PlayedRecords, what_is_damaged_is_passed_over) {
  damage(middle + 200);  // in a chunk
  PlayedRecord record(path);
  EXPECT_NEAR(record.end_s(), kEnd_s, 1e-6);
  record.seek(20.5);
  double before_s = 0, longest_s = 0;
  bool jumped = false;
  for (double at_s = 20.5; record.advance(at_s); at_s += 0.02) {
    longest_s = std::max(longest_s, shown_s(record) - before_s);
    jumped = jumped || (record.world().has_jumped() && shown_s(record) > 39.9);
    before_s = shown_s(record);
    record.world().forget_news();
  }
  EXPECT_TRUE(jumped);
  EXPECT_GT(longest_s, 5);
  EXPECT_TRUE(record.is_damaged());
  EXPECT_NEAR(record.time_s(), kEnd_s, 0.03);
  record.seek(50);
  EXPECT_NEAR(shown_s(record), 50, 0.03);
  record.seek(35);  // the first that can be shown
  EXPECT_TRUE(record.world().can_be_shown());
}

// The bits belong to the head of the chunk and to its content. A record has no end when its writer was killed.
TEST_F(PlayedRecords, one_flipped_bit_in_the_first_chunk_costs_what_is_before_the_next_keyframes) {
  const auto [begin, end] = first_chunk();
  for (const bool is_finished : {true, false}) {
    if (!is_finished) std::filesystem::resize_file(path, std::filesystem::file_size(path) - 40'000);
    for (const std::uint64_t byte :
         {begin, begin + 1, begin + 3, begin + 26, begin + 34, begin + 39, begin + 45, begin + 60, (begin + end) / 2}) {
      flip(byte);
      testing::internal::CaptureStderr();
      PlayedRecord record(path);
      const std::string said = testing::internal::GetCapturedStderr();
      EXPECT_NE(said.find(path + ": damaged at byte " + std::to_string(begin)), std::string::npos)
          << "byte " << byte - begin << ": " << said;
      EXPECT_NE(said.find("10.00 s"), std::string::npos) << said;
      EXPECT_TRUE(record.is_damaged());
      record.seek(0);
      EXPECT_NEAR(shown_s(record), 10, 0.03) << "byte " << byte - begin;
      record.seek(31.3);
      EXPECT_NEAR(shown_s(record), 31.3, 0.03);
      flip(byte);
    }
  }
}

TEST_F(PlayedRecords, that_shows_nothing_says_where_it_is_damaged) {
  const auto [begin, end] = first_chunk();
  std::filesystem::resize_file(path, end + 200);
  flip((begin + end) / 2);
  try {
    const PlayedRecord record(path);
    FAIL() << "it has no second keyframes";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              path + ": damaged at byte " + std::to_string(begin) + ": a record without a scene");
  }
}

TEST_F(PlayedRecords, that_ends_in_damage_ends_before_it) {
  std::filesystem::resize_file(path, middle + 5);
  PlayedRecord record(path);
  EXPECT_TRUE(record.is_damaged());
  EXPECT_LT(record.end_s(), 31);
  record.seek(59);
  EXPECT_TRUE(record.world().can_be_shown());
  EXPECT_NEAR(shown_s(record), record.end_s(), 0.03);
  EXPECT_FALSE(record.advance(60));
}

}  // namespace
}  // namespace sectio::net_test
