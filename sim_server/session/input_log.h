// The journal of inputs: a file with the inputs of every step of a session, from which the session can be run again,
// bit for bit. Each record has a checksum; what a torn or damaged file holds before the damage is read. A record of a
// session (--record, MCAP) holds the same inputs, and is read likewise.
#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/mcap/mcap_reader.h"
#include "common/messages/inputs.h"

namespace sectio {

// The beginning of a file says enough of its session to begin it again.
struct InputLogHeader {
  std::string scene;                // the file, with its whole path
  std::vector<std::string> bodies;  // bodies of this server
  std::uint64_t state_hash = 0;     // before the first step
  std::string session = {};         // empty: the one that the scene names
};

std::string to_json(const InputLogHeader& header);

// The record of a server has the header among its metadata, under this key, and the inputs on this topic.
constexpr const char* kRecordHeader = "session";
constexpr const char* kInputTopic = "step_inputs";

constexpr std::uint64_t kAllSteps = ~std::uint64_t{0};  // up to the last one that is there

// DIRECTORY/inputs, or the record itself.
std::string input_log_path(const std::string& directory_or_record);
bool is_input_log(const std::string& path);  // or a record

class InputLogReader {
 public:
  // Throws InputError "PATH: why" when it is no journal of inputs.
  explicit InputLogReader(const std::string& path);

  const InputLogHeader& header() const { return header_; }
  // The next record, which holds one step; nothing at the end and where the file is damaged.
  std::optional<StepInputs> next();
  // Goes on with the record at this byte, of a journal, as whole_bytes() has named it. False: it has fewer.
  bool seek(std::uint64_t byte);
  // Passes the records up to this byte, of a journal, and looks at their checksums alone. False: they aren't whole.
  bool pass(std::uint64_t byte);
  // After the last record: where the whole part ends, and a word about the rest; empty when there is none.
  std::uint64_t whole_bytes() const { return at_; }
  std::string damage() const;
  // The rest is what the death of a program or of a machine leaves: one record without its end, or zeros where nothing
  // had come to the disk yet. Else a journal was damaged that had been whole, and records may be behind the damage.
  bool is_torn();
  // The same as damage(), or a word about a record that nobody finished.
  std::string note() const;

 private:
  bool is_finished() const { return record_ && record_->is_finished(); }
  void open_record();
  std::optional<std::vector<std::uint8_t>> read();

  std::string path_;
  std::unique_ptr<McapReader> record_;  // null: a journal
  std::ifstream file_;
  std::uint64_t size_ = 0, at_ = 0;
  std::uint64_t last_step_ = 0, time_ns_ = 0;  // last step read; simulated time at which a record tells it
  std::optional<McapReader::Message> pending_;
  bool broken_ = false;  // the file is damaged, or at its end
  InputLogHeader header_;
};

// Writes every step at once, so that it survives the end of the program, and has a thread of its own that brings the
// file to the disk once a second, so that no more is lost when the machine dies.
class InputLog {
 public:
  // A new file; throws InputError when it can't be written.
  InputLog(const std::string& path, const InputLogHeader& header);
  // Goes on with a file of which so much is whole. The first `known_steps` are known to end at a byte, and are not read
  // before somebody asks for them.
  InputLog(const std::string& path, std::uint64_t whole_bytes, std::uint64_t known_bytes = 0,
           std::uint64_t known_steps = 0);
  ~InputLog();

  // Nothing, or a word about why this step and those that follow are not kept: said once. Simulation's thread.
  std::optional<std::string> append(const StepInputs& one_step);

  std::uint64_t bytes() const;  // length of the whole records
  // The records from a step on, as many as fit about `most_bytes`; none when they are not kept. One thread, any one.
  std::vector<StepRecord> read_from(std::uint64_t first_step, std::size_t most_bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
