#include "sim_server/session/checkpoint.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

namespace sectio::session_test {
namespace {

namespace fs = std::filesystem;

Checkpoint some_checkpoint(std::uint64_t step, std::size_t bytes = 1000) {
  return {.session = 7,
          .step = step,
          .epoch = 3,
          .state_hash = 5,
          .inputs_bytes = 10 * step,
          .journal_bytes = 20 * step,
          .simulation = std::vector<std::uint8_t>(bytes, static_cast<std::uint8_t>(step)),
          .recorder = {1, 2, 3}};
}

class Checkpoints : public testing::Test {
 protected:
  Checkpoints() : directory_(testing::TempDir() + "sectio_checkpoints_" + std::to_string(getpid())) {
    fs::create_directories(directory_);
  }
  ~Checkpoints() override { fs::remove_all(directory_); }

  void write(std::uint64_t first, std::uint64_t last, std::uint64_t most_bytes = CheckpointWriter::kMostBytes) const {
    CheckpointWriter writer(directory_, first == 1, first - 1, most_bytes);
    for (std::uint64_t step = first; step <= last; ++step) {
      writer.put(some_checkpoint(step));
      while (!writer.is_ready()) std::this_thread::yield();
    }
  }
  std::vector<std::uint64_t> kept() const {
    std::vector<std::uint64_t> steps;
    for (const fs::directory_entry& file : fs::directory_iterator(checkpoints_path(directory_)))
      steps.push_back(std::stoull(file.path().filename().string()));
    std::ranges::sort(steps);
    return steps;
  }
  std::string path_of(std::uint64_t step) const {
    for (const fs::directory_entry& file : fs::directory_iterator(checkpoints_path(directory_)))
      if (std::stoull(file.path().filename().string()) == step) return file.path().string();
    return {};
  }
  void flip_byte(const std::string& path, std::size_t at) const {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    file.seekg(static_cast<std::streamoff>(at));
    const char byte = static_cast<char>(file.get() ^ 4);
    file.seekp(static_cast<std::streamoff>(at));
    file.put(byte);
  }

  std::string directory_;
};

TEST_F(Checkpoints, is_read_as_it_was_written) {
  write(1, 4);
  const auto found = find_checkpoint(directory_, 7, 3);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->step, 3u);
  EXPECT_EQ(found->epoch, 3u);
  EXPECT_EQ(found->inputs_bytes, 30u);
  EXPECT_EQ(found->simulation, some_checkpoint(3).simulation);
  EXPECT_EQ(find_checkpoint(directory_, 7, 1000)->step, 4u);
  EXPECT_FALSE(find_checkpoint(directory_, 8, 1000)) << "of another session";
  EXPECT_FALSE(find_checkpoint(directory_, 7, 0));
  EXPECT_FALSE(find_checkpoint(directory_ + "/nowhere", 7, 1000));
}

TEST_F(Checkpoints, torn_and_damaged_ones_are_passed_over) {
  write(1, 3);
  fs::resize_file(path_of(3), fs::file_size(path_of(3)) - 5);
  EXPECT_EQ(find_checkpoint(directory_, 7, 1000)->step, 2u);
  flip_byte(path_of(2), 500);
  EXPECT_EQ(find_checkpoint(directory_, 7, 1000)->step, 1u);
  fs::resize_file(path_of(1), 0);
  EXPECT_FALSE(find_checkpoint(directory_, 7, 1000));
}

TEST_F(Checkpoints, those_of_another_build_are_told_of_in_one_line_and_not_read) {
  write(1, 40);
  for (std::uint64_t step = 2; step <= 40; ++step) {
    flip_byte(path_of(step), 16 + 8 + 2);                 // in the identity of the program
    fs::resize_file(path_of(step), 16 + 8 + 64 + 8 + 8);  // there is no more to read
  }
  testing::internal::CaptureStderr();
  EXPECT_EQ(find_checkpoint(directory_, 7, 1000)->step, 1u);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  EXPECT_NE(said.find("another build of the program has written it; and 38 like it"), std::string::npos) << said;
}

TEST(Checkpoint, no_byte_can_change_and_none_can_be_missing) {
  const std::vector<std::uint8_t> whole = to_bytes(some_checkpoint(1, 50));
  std::string why;
  ASSERT_TRUE(checkpoint_from(whole, why));
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::vector<std::uint8_t> bytes = whole;
    bytes[i] ^= 0x10;
    EXPECT_FALSE(checkpoint_from(bytes, why)) << i;
    EXPECT_FALSE(checkpoint_from(std::span(whole).first(i), why)) << i;
  }
}

TEST_F(Checkpoints, a_session_that_branches_off_forgets_what_came_later) {
  write(1, 5);
  write(3, 3);
  EXPECT_EQ(kept(), (std::vector<std::uint64_t>{1, 2, 3}));
}

TEST_F(Checkpoints, are_shared_up_to_a_step) {
  write(1, 5);
  share_checkpoints(directory_, directory_ + "/try_2", 3);
  EXPECT_EQ(find_checkpoint(directory_ + "/try_2", 7, 1000)->step, 3u);
}

TEST_F(Checkpoints, few_enough_are_kept_evenly_spread) {
  write(1, 200, 20 * to_bytes(some_checkpoint(1)).size());
  const std::vector<std::uint64_t> steps = kept();
  EXPECT_EQ(steps.size(), 20u);
  EXPECT_EQ(steps.back(), 200u);
  std::uint64_t before = 0;
  for (const std::uint64_t step : steps) {
    EXPECT_LE(step - before, 30u);
    before = step;
  }
}

// A disk that was full of checkpoints had no room for the report of the session.
TEST_F(Checkpoints, leave_room_on_the_disk) {
  constexpr std::uint64_t kMoreThanThereIs = std::uint64_t{1} << 60;
  CheckpointWriter writer(directory_, true, 0, CheckpointWriter::kMostBytes, kMoreThanThereIs);
  for (std::uint64_t step = 1; step <= 10; ++step) {
    writer.put(some_checkpoint(step));
    while (!writer.is_ready()) std::this_thread::yield();
  }
  EXPECT_EQ(kept(), (std::vector<std::uint64_t>{8, 9, 10}));
}

// Somebody else fills the disk for a moment. A file that another try has as well takes no room.
TEST_F(Checkpoints, that_are_older_give_way_two_at_a_time_but_for_those_of_another_try) {
  constexpr std::uint64_t kMoreThanThereIs = std::uint64_t{1} << 60;
  write(1, 12, CheckpointWriter::kMostBytes);
  const auto put = [&](std::uint64_t step) {
    CheckpointWriter writer(directory_, false, step, CheckpointWriter::kMostBytes, kMoreThanThereIs);
    writer.put(some_checkpoint(step));
    while (!writer.is_ready()) std::this_thread::yield();
  };
  put(13);
  EXPECT_EQ(kept().size(), 11u);
  const std::string another = directory_ + "/another_try";
  share_checkpoints(directory_, another, 13);
  put(14);
  EXPECT_EQ(kept().size(), 12u);
}

TEST_F(Checkpoints, a_disk_that_takes_nothing_is_told_of_once) {
  CheckpointWriter writer(directory_, true, 0);
  fs::remove_all(checkpoints_path(directory_));
  int faults = 0;
  for (std::uint64_t step = 1; step <= 3; ++step) {
    writer.put(some_checkpoint(step));
    while (!writer.is_ready()) std::this_thread::yield();
    faults += writer.take_fault().has_value();
  }
  EXPECT_EQ(faults, 1);
}

}  // namespace
}  // namespace sectio::session_test
