#include "common/core/write_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/core/error.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, int error) {
  throw InputError(path + ": can't be written: " + std::strerror(error));
}

constexpr int kMostLinks = 40;  // so many does the system follow

fs::path without_links(fs::path path) {
  std::error_code none;
  for (int n = 0; n < kMostLinks && fs::is_symlink(path, none); ++n)
    path = path.parent_path() / fs::read_symlink(path, none);
  return path;
}

// The file that takes the bytes first. A link is followed: its target is replaced.
struct Place {
  explicit Place(const std::string& path) : target(without_links(path).string()), opened(target) {
    std::error_code none;
    const fs::file_status status = fs::status(target, none);
    if (!fs::exists(status) || fs::is_regular_file(status)) opened += ".part";
  }
  bool is_beside() const { return opened != target; }

  std::string target, opened;
};

int open_at(const Place& place) {
  return ::open(place.opened.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
}

// 0, or the error.
int write_all(int file, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written > 0)
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    else if (written == 0 || errno != EINTR)
      return written == 0 ? ENOSPC : errno;
  }
  return 0;
}

}  // namespace

void write_file(const std::string& path, std::span<const std::uint8_t> bytes, OnDisk on_disk) {
  const Place place(path);
  const int file = open_at(place);
  if (file < 0) fail(path, errno);
  int error = write_all(file, bytes);
  if (error == 0 && on_disk == OnDisk::now && ::fdatasync(file) != 0) error = errno;
  if (::close(file) != 0 && error == 0) error = errno;  // some file systems say only now that they are full
  if (!place.is_beside()) return error == 0 ? void() : fail(path, error);
  if (error == 0 && ::rename(place.opened.c_str(), place.target.c_str()) != 0) error = errno;
  if (error == 0) return;
  ::unlink(place.opened.c_str());
  fail(path, error);
}

void write_file(const std::string& path, std::string_view text) {
  write_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void keep_beginning(const std::string& path, std::uint64_t bytes) {
  std::error_code not_a_file;
  fs::resize_file(path, bytes, not_a_file);
}

void check_can_write(const std::string& path) {
  const Place place(path);
  if (!place.is_beside()) {
    if (::access(path.c_str(), W_OK) != 0 || fs::is_directory(path))
      fail(path, fs::is_directory(path) ? EISDIR : errno);
    return;
  }
  const int file = open_at(place);
  if (file < 0) fail(path, errno);
  ::close(file);
  ::unlink(place.opened.c_str());
}

}  // namespace sectio
