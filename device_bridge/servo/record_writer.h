// The servo loop's records as files, written by a thread that may wait for the disk.
#pragma once

#include <cstdint>
#include <string>

#include "device_bridge/servo/line_file.h"
#include "device_bridge/servo/ring.h"
#include "device_bridge/servo/servo_state.h"

namespace sectio {

// One CSV line a tick, in a trace, which a scene can play, and in a log, which is a trace with more columns. When the
// server falls silent, and when it is back, the program's own log has a line.
class RecordWriter {
 public:
  // An empty path writes no file. Throws InputError when a file can't be written.
  explicit RecordWriter(const std::string& log_path, const std::string& trace_path = "");

  // Takes everything out of the ring, and gives it to the disk. One thread.
  void drain(Ring<ServoRecord>& records);

  // Throws std::runtime_error when the disk did not take all of it.
  void finish();

  std::uint64_t written() const { return written_; }
  // A server has answered a pose of this hand.
  bool was_answered() const { return was_answered_; }

 private:
  void write(const ServoRecord& record);

  LineFile log_, trace_;
  std::string line_;
  std::uint64_t written_ = 0;
  bool server_silent_ = false, is_too_old_ = false, was_answered_ = false;
};

}  // namespace sectio
