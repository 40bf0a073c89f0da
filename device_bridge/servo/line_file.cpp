#include "device_bridge/servo/line_file.h"

#include <filesystem>
#include <stdexcept>

#include "common/core/error.h"
#include "common/core/log.h"

namespace sectio {

LineFile::LineFile(const std::string& flag, const std::string& path, const std::string& first_line)
    : name_(flag + ": " + path), path_(path), first_line_(first_line) {
  if (path_.empty()) return;
  out_.open(path_, std::ios::app);
  if (!out_) throw InputError(name_ + ": can't be written");
}

void LineFile::append(std::string_view lines) {
  if (path_.empty() || full_) return;
  if (appended_bytes_ == 0) {
    std::error_code not_a_file;
    std::filesystem::resize_file(path_, 0, not_a_file);
    out_ << first_line_;
    appended_bytes_ = first_line_.size();
  }
  out_ << lines;
  appended_bytes_ += lines.size();
}

void LineFile::flush() {
  if (path_.empty() || full_) return;
  out_.flush();
  if (out_) {
    whole_bytes_ = appended_bytes_;
    return;
  }
  full_ = true;
  out_.close();
  std::error_code not_a_file;
  std::filesystem::resize_file(path_, whole_bytes_, not_a_file);
  log_warning(name_ + ": the disk takes no more; the session goes on, and what came before stays");
}

void LineFile::finish() {
  flush();
  if (full_) throw std::runtime_error(name_ + ": not all of it could be written");
}

}  // namespace sectio
