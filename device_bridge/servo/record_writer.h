// The servo loop's log, written by a thread that may wait for the disk.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include "device_bridge/servo/ring.h"
#include "device_bridge/servo/servo_state.h"

namespace sectio {

// One CSV line a tick; load_trace() reads the file as a trace, so that a session can be played again. When the server
// falls silent, and when it is back, the program's log has a line.
class RecordWriter {
 public:
  // An empty path writes no file. Throws InputError when the file can't be made.
  explicit RecordWriter(const std::string& path);

  // Takes everything out of the ring. One thread.
  void drain(Ring<ServoRecord>& records);

  // Writes the rest of the buffer; throws std::runtime_error when the disk did not take all of it.
  void finish();

  std::uint64_t written() const { return written_; }

 private:
  void write(const ServoRecord& record);

  std::string path_;
  std::ofstream out_;
  std::string line_;
  std::uint64_t written_ = 0;
  bool server_silent_ = false;
};

}  // namespace sectio
