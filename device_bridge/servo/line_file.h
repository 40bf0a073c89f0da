// A text file that grows by whole lines while a session runs. When the disk takes no more, there is one warning, the
// session goes on, and the file ends with the last line that was written whole.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

namespace sectio {

class LineFile {
 public:
  // `flag` is what messages name; an empty path writes no file. An older file stays as it is until there is a line for
  // the new one. Throws InputError when the file can't be written.
  LineFile(const std::string& flag, const std::string& path, const std::string& first_line);

  // Whole lines, which end with '\n'.
  void append(std::string_view lines);
  void flush();
  // Throws std::runtime_error when not all lines were written.
  void finish();

 private:
  std::string name_, path_, first_line_;
  std::ofstream out_;
  std::uintmax_t appended_bytes_ = 0, whole_bytes_ = 0;
  bool full_ = false;
};

}  // namespace sectio
