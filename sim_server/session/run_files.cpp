#include "sim_server/session/run_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/write_file.h"
#include "common/messages/codec.h"
#include "common/messages/epoch.h"
#include "sim_server/session/input_log.h"

namespace sectio {

void make_directory(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw InputError(path + ": can't be made: " + error.message());
}

DirectoryLock::DirectoryLock(const std::string& path) {
  if (path.empty()) return;
  make_directory(path);
  file_ = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file_ < 0) throw InputError(path + ": can't be opened");
  if (::flock(file_, LOCK_EX | LOCK_NB) == 0) return;
  ::close(file_);
  throw InputError(path + ": another run writes there");
}

DirectoryLock::~DirectoryLock() {
  if (file_ >= 0) ::close(file_);
}

namespace {

// False when not all of it could be copied. Closes what it is given.
bool copy_bytes(int in, int out, std::uint64_t from_byte, std::uint64_t bytes, OnDisk on_disk) {
  auto at = static_cast<off64_t>(from_byte);
  std::uint64_t left = bytes;
  for (ssize_t copied = 1; in >= 0 && out >= 0 && left > 0 && copied > 0; left -= static_cast<std::uint64_t>(copied))
    copied = std::max<ssize_t>(0, ::copy_file_range(in, &at, out, nullptr, left, 0));
  const bool is_there = in >= 0 && out >= 0 && left == 0 && (on_disk != OnDisk::now || ::fdatasync(out) == 0);
  if (in >= 0) ::close(in);
  if (out >= 0) ::close(out);
  return is_there;
}

int opened_to_read(const std::string& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
}

// The inputs of a session that has not ended, in the newest try of a directory; null: there are none.
std::unique_ptr<InputLogReader> unfinished_inputs(const std::string& directory) {
  const std::string newest = try_directory(directory, newest_try(directory));
  if (!std::filesystem::exists(input_log_path(newest)) || std::filesystem::exists(newest + "/report.json"))
    return nullptr;
  try {
    return std::make_unique<InputLogReader>(input_log_path(newest));
  } catch (const InputError&) {  // nothing that could go on
    return nullptr;
  }
}

// The same step of the same session, whichever server has run it.
bool are_same(const StepInputs& one, const StepInputs& other) {
  const auto bytes = [](const StepInputs& inputs) { return encode(StepInputs{0, 0, inputs.steps}); };
  return same_session(one.epoch, other.epoch) && bytes(one) == bytes(other);
}

// The last step of a journal; nothing: it has none, or is not the same as a newer one, as far as both go.
std::optional<std::uint64_t> last_step(std::unique_ptr<InputLogReader> inputs, std::unique_ptr<InputLogReader> newer) {
  std::optional<std::uint64_t> last;
  while (const std::optional<StepInputs> next = inputs ? inputs->next() : std::nullopt) {
    const std::optional<StepInputs> known = newer ? newer->next() : std::nullopt;
    if (known && !are_same(*known, *next)) return std::nullopt;
    last = next->steps.front().step;
  }
  return last;
}

}  // namespace

std::string try_directory(const std::string& directory, int attempt) {
  return directory.empty() || attempt == 1 ? directory : directory + "/try_" + std::to_string(attempt);
}

// A directory may hold tries of an earlier session, beyond a gap or older than those of this one.
int newest_try(const std::string& directory) {
  if (!std::filesystem::is_directory(directory)) return 1;
  std::optional<std::filesystem::file_time_type> newest;
  int attempt = 1;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    int number = 1;
    char rest = 0;
    const std::string name = entry.path().filename();
    if (name != "inputs" && std::sscanf(name.c_str(), "try_%d%c", &number, &rest) != 1) continue;
    std::error_code error;
    const auto written = std::filesystem::last_write_time(input_log_path(try_directory(directory, number)), error);
    if (error || (newest && written <= *newest)) continue;
    newest = written;
    attempt = number;
  }
  return attempt;
}

std::optional<Furthest> furthest_unfinished(std::span<const std::string> newest_first) {
  std::optional<Furthest> furthest;
  for (const std::string& directory : newest_first) {
    const auto step =
        last_step(unfinished_inputs(directory), furthest ? unfinished_inputs(furthest->directory) : nullptr);
    if (step && (!furthest || *step > furthest->step)) furthest = {directory, *step};
  }
  return furthest;
}

void refuse_unfinished(const std::string& directory) {
  if (directory.empty()) return;
  const DirectoryLock lock(directory);
  if (auto inputs = unfinished_inputs(directory); !inputs || !inputs->next()) return;
  throw InputError(directory + ": holds a session that has not ended: --resume " + directory +
                   " goes on with it; another --export begins a new one");
}

void refuse_unfinished_record(const std::string& path) {
  try {
    if (!std::filesystem::exists(path) || !InputLogReader(path).next()) return;
    McapReader record(path);
    while (record.next_chunk()) continue;
    if (record.is_finished()) return;
  } catch (const InputError&) {  // nothing that could go on
    return;
  }
  throw InputError(path + ": holds a session that has not ended: --resume " + path +
                   " goes on with it; another --record begins a new one");
}

std::string record_to_write(const std::string& path, bool goes_on) {
  const std::filesystem::path first(path);
  std::string free = path;
  int number = 1;
  while (is_mcap(free))
    free = (first.parent_path() / first.stem()).string() + "_" + std::to_string(++number) + first.extension().string();
  if (goes_on || number > 2) return free;
  refuse_unfinished_record(path);
  return path;
}

int free_try_after(const std::string& directory, int attempt) {
  do ++attempt;
  while (!directory.empty() && std::filesystem::exists(input_log_path(try_directory(directory, attempt))));
  return attempt;
}

bool copy_beginning(const std::string& from, const std::string& to, std::uint64_t bytes) {
  std::error_code error;
  if (const std::uint64_t size = std::filesystem::file_size(from, error); error || size < bytes) return false;
  if (from != to) {
    const int out = ::open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (!copy_bytes(opened_to_read(from), out, 0, bytes, OnDisk::later)) throw InputError(to + ": can't be written");
    return true;
  }
  std::filesystem::resize_file(to, bytes, error);
  if (error) throw InputError(to + ": can't be written: " + error.message());
  return true;
}

std::string keep_rest(const std::string& path, std::uint64_t from_byte) {
  std::string to = path + ".damaged";
  std::error_code error;
  for (int n = 2; std::filesystem::exists(to, error); ++n) to = path + ".damaged." + std::to_string(n);
  const std::uint64_t size = std::filesystem::file_size(path, error);
  const int out = ::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (error || !copy_bytes(opened_to_read(path), out, from_byte, size - from_byte, OnDisk::now)) {
    if (out >= 0) ::unlink(to.c_str());
    throw InputError(to + ": can't be written");
  }
  return to;
}

std::string obj_path(const std::string& directory, const std::string& body) {
  std::string name = body;
  std::replace(name.begin(), name.end(), '/', '_');
  return directory + "/" + name + ".obj";
}

void write_obj(const std::string& path, const TriangleMesh& mesh, PositionsView positions_world_m) {
  std::string text;
  std::vector<std::uint32_t> number(mesh.vertex_slots(), 0);
  std::uint32_t next = 1;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    number[v] = next++;
    const Vec3f x = positions_world_m[v];
    text += formatted("v %.9g %.9g %.9g\n", double(x[0]), double(x[1]), double(x[2]));
  }
  for (const Surface surface : {Surface::skin, Surface::wall}) {
    text += surface == Surface::skin ? "g skin\n" : "g wall\n";
    for (const Triangle& t : mesh.triangles()) {
      if (!t.alive() || t.surface != surface) continue;
      text += formatted("f %u %u %u\n", number[t.v[0]], number[t.v[1]], number[t.v[2]]);
    }
  }
  write_file(path, text);
}

}  // namespace sectio
