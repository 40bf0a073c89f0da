// Checkpoints: the state of a session after a step, as a file. From one of them the session goes on as if it had run
// all steps before. DIRECTORY/checkpoints holds the newest, and of those before as many as fit into a number of bytes
// and leave room on the disk for a session's journals and its report, as evenly spread as they come.
//
// File: "SECTIOC1", the checksum of what follows (u64), and that (common/math/archive.h). It is for the same build of
// the program alone; others, damaged ones and those of another session are passed over with a word.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace sectio {

struct Checkpoint {
  std::uint64_t session = 0;  // InputLogHeader::state_hash
  std::uint64_t step = 0;     // the last one that has been run
  std::uint64_t epoch = 0;
  std::uint64_t state_hash = 0;                       // after the step
  std::uint64_t inputs_bytes = 0, journal_bytes = 0;  // lengths of these files up to the step
  std::vector<std::uint8_t> simulation, recorder;

  template <class A>
  void archive(A& a) {
    a(session, step, epoch, state_hash, inputs_bytes, journal_bytes, simulation, recorder);
  }
};

std::vector<std::uint8_t> to_bytes(const Checkpoint& checkpoint);
// Nothing, and why not, when the bytes are no whole checkpoint of this program.
std::optional<Checkpoint> checkpoint_from(std::span<const std::uint8_t> bytes, std::string& why_not);

std::string checkpoints_path(const std::string& directory);
// The newest checkpoint of a session up to a step; nothing when there is none. Into the log: those that were passed
// over, and why.
std::optional<Checkpoint> find_checkpoint(const std::string& directory, std::uint64_t session, std::uint64_t last_step);
// Gives a session that branches off after a step the checkpoints before it. Files that can't be shared are left out.
void share_checkpoints(const std::string& from_directory, const std::string& to_directory, std::uint64_t last_step);

// Writes checkpoints, by a thread of its own, and removes those that are too many.
class CheckpointWriter {
 public:
  static constexpr std::uint64_t kMostBytes = std::uint64_t{2} << 30, kSpareBytes = std::uint64_t{64} << 20;

  // Makes DIRECTORY/checkpoints; without it nothing is written, and take_fault() says so. `fresh`: removes what is
  // there; else what came after `step`.
  CheckpointWriter(const std::string& directory, bool fresh, std::uint64_t step, std::uint64_t most_bytes = kMostBytes,
                   std::uint64_t spare_bytes = kSpareBytes);
  ~CheckpointWriter();

  // The thread has written the last one.
  bool is_ready() const;
  void put(Checkpoint checkpoint);
  // Why a checkpoint could not be written, once in a row of failures.
  std::optional<std::string> take_fault();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
