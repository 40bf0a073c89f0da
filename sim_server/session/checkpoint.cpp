#include "sim_server/session/checkpoint.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/core/program_id.h"
#include "common/core/write_file.h"
#include "common/delta/checksum.h"
#include "common/math/archive.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCheckpointMagic = "SECTIOC1";
constexpr std::uint64_t kCheckpointSeed = 2;
constexpr std::size_t kHeaderBytes = 16;  // magic, checksum
constexpr const char* kOtherBuild = "another build of the program has written it";
constexpr std::size_t kNewest = 3;  // these are kept, however large they are
constexpr int kMostRemoved = 2;     // by one that is written, because the disk is short of room

// By step; the size of each.
std::map<std::uint64_t, std::uint64_t> checkpoints_in(const std::string& directory) {
  std::map<std::uint64_t, std::uint64_t> found;
  std::error_code error;
  for (fs::directory_iterator file(checkpoints_path(directory), error), end; !error && file != end;
       file.increment(error)) {
    const std::string name = file->path().filename().string();
    std::uint64_t step = 0;
    const auto [rest, bad] = std::from_chars(name.data(), name.data() + name.size(), step);
    std::error_code no_size;
    if (bad == std::errc() && rest == name.data() + name.size() && file->is_regular_file(no_size))
      found[step] = file->file_size(no_size);
  }
  return found;
}

std::string path_of(const std::string& directory, std::uint64_t step) {
  return checkpoints_path(directory) + formatted("/%012llu", static_cast<unsigned long long>(step));
}

std::vector<std::uint8_t> read_file(const std::string& path, std::size_t most_bytes = ~std::size_t{0}) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  std::vector<std::uint8_t> bytes(file ? static_cast<std::size_t>(std::max<std::streamoff>(0, file.tellg())) : 0);
  bytes.resize(std::min(bytes.size(), most_bytes));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) bytes.clear();
  return bytes;
}

// Empty: as far as its first bytes say, it is one of this program and of this session.
std::string foreign(const std::string& path, std::uint64_t session) {
  constexpr std::size_t kFirstBytes = 512;
  const std::vector<std::uint8_t> bytes = read_file(path, kFirstBytes);
  if (bytes.size() < kHeaderBytes) return {};
  try {
    Archive archive(std::span<const std::uint8_t>(bytes).subspan(kHeaderBytes));
    std::string program;
    std::uint64_t its_session = 0;
    archive(program);
    if (program != program_id()) return kOtherBuild;
    archive(its_session);
    return its_session == session ? "" : "it is of another session";
  } catch (const InputError&) {
    return {};
  }
}

// The one that is missed least: the steps between its neighbours are the fewest.
std::uint64_t least_needed(const std::map<std::uint64_t, std::uint64_t>& kept) {
  std::uint64_t least = kept.begin()->first, fewest = ~std::uint64_t{0}, before = 0;
  const auto end = std::prev(kept.end(), kNewest);
  for (auto at = kept.begin(); at != end; before = at->first, ++at)
    if (const std::uint64_t gap = std::next(at)->first - before; gap < fewest) fewest = gap, least = at->first;
  return least;
}

}  // namespace

std::vector<std::uint8_t> to_bytes(const Checkpoint& checkpoint) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(checkpoint.simulation.size() + checkpoint.recorder.size() + 256);
  bytes.assign(kCheckpointMagic.begin(), kCheckpointMagic.end());
  bytes.resize(kHeaderBytes);
  Archive archive(bytes);
  std::string program = program_id();
  archive(program, const_cast<Checkpoint&>(checkpoint));  // it is only read
  const std::uint64_t sum = checksum(kCheckpointSeed, std::span(bytes).subspan(kHeaderBytes));
  std::memcpy(bytes.data() + kCheckpointMagic.size(), &sum, sizeof sum);
  return bytes;
}

std::optional<Checkpoint> checkpoint_from(std::span<const std::uint8_t> bytes, std::string& why_not) {
  const auto no = [&](const char* why) {
    why_not = why;
    return std::nullopt;
  };
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), kCheckpointMagic.data(), kCheckpointMagic.size()) != 0)
    return no("not a checkpoint");
  std::uint64_t sum = 0;
  std::memcpy(&sum, bytes.data() + kCheckpointMagic.size(), sizeof sum);
  bytes = bytes.subspan(kHeaderBytes);
  if (checksum(kCheckpointSeed, bytes) != sum) return no("it is damaged");
  try {
    Archive archive(bytes);
    std::string program;
    archive(program);
    if (program != program_id()) return no(kOtherBuild);
    std::optional<Checkpoint> checkpoint(std::in_place);
    archive(*checkpoint);
    return checkpoint;
  } catch (const InputError&) {
    return no("it ends too early");
  }
}

std::string checkpoints_path(const std::string& directory) {
  return directory + "/checkpoints";
}

std::optional<Checkpoint> find_checkpoint(const std::string& directory, std::uint64_t session,
                                          std::uint64_t last_step) {
  const auto found = checkpoints_in(directory);
  std::optional<Checkpoint> checkpoint;
  std::map<std::string, std::vector<std::string>> passed_over;  // by the reason
  for (auto at = found.upper_bound(last_step); at != found.begin() && !checkpoint;) {
    --at;
    const std::string path = path_of(directory, at->first);
    std::string why = foreign(path, session);
    if (why.empty()) checkpoint = checkpoint_from(read_file(path), why);
    if (checkpoint && checkpoint->step > last_step) checkpoint.reset(), why = "its name is not its step";
    if (!checkpoint) passed_over[why].push_back(path);
  }
  for (const auto& [why, paths] : passed_over)
    log_warning(paths.front() + ": passed over: " + why +
                (paths.size() > 1 ? "; and " + std::to_string(paths.size() - 1) + " like it" : ""));
  return checkpoint;
}

void share_checkpoints(const std::string& from_directory, const std::string& to_directory, std::uint64_t last_step) {
  std::error_code error;
  fs::create_directories(checkpoints_path(to_directory), error);
  for (const auto& [step, size] : checkpoints_in(from_directory))
    if (step <= last_step) fs::create_hard_link(path_of(from_directory, step), path_of(to_directory, step), error);
}

namespace {

// The files of checkpoints in a directory, as many as there is room for.
class CheckpointFiles {
 public:
  // Removes those after a step; all of them when `fresh`.
  CheckpointFiles(std::string directory, bool fresh, std::uint64_t step, std::uint64_t most_bytes,
                  std::uint64_t spare_bytes)
      : directory_(std::move(directory)), most_bytes_(most_bytes), spare_bytes_(spare_bytes) {
    std::error_code error;
    if (fresh) fs::remove_all(checkpoints_path(directory_), error);
    fs::create_directories(checkpoints_path(directory_), error);
    for (const auto& [at, size] : checkpoints_in(directory_)) {
      if (at <= step) {
        kept_[at] = size;
        total_ += size;
      } else {
        fs::remove(path_of(directory_, at), error);
      }
    }
  }
  // Throws an InputError when it can't be written.
  void write(const Checkpoint& checkpoint) {
    const std::vector<std::uint8_t> bytes = to_bytes(checkpoint);
    int may_remove = kMostRemoved;
    make_room(bytes.size(), may_remove);
    try {
      write_file(path_of(directory_, checkpoint.step), bytes, OnDisk::now);
    } catch (const InputError&) {  // a quota is full, which the disk doesn't know of
      if (kept_.size() <= kNewest) throw;
      remove_one();
      write_file(path_of(directory_, checkpoint.step), bytes, OnDisk::now);
    }
    total_ += bytes.size() - std::exchange(kept_[checkpoint.step], bytes.size());
    while (kept_.size() > kNewest && total_ > most_bytes_) remove_one();
    make_room(0, may_remove);
  }

 private:
  bool is_scarce(std::uint64_t bytes) const {
    std::error_code error;
    const fs::space_info space = fs::space(checkpoints_path(directory_), error);
    return !error && space.available < bytes + spare_bytes_;
  }
  // A disk that somebody else fills for a moment doesn't take all of them. A file that another try has as well takes no
  // room.
  void make_room(std::uint64_t bytes, int& may_remove) {
    std::error_code error;
    for (; may_remove > 0 && kept_.size() > kNewest && is_scarce(bytes); --may_remove) {
      if (fs::hard_link_count(path_of(directory_, least_needed(kept_)), error) > 1) return;
      if (!std::exchange(has_said_, true))
        log_warning(directory_ + ": the disk is nearly full: older checkpoints make room for newer ones");
      remove_one();
    }
  }
  void remove_one() {
    const auto at = kept_.find(least_needed(kept_));
    ::unlink(path_of(directory_, at->first).c_str());
    total_ -= at->second;
    kept_.erase(at);
  }

  std::string directory_;
  std::uint64_t most_bytes_, spare_bytes_;
  std::map<std::uint64_t, std::uint64_t> kept_;  // sizes by step
  std::uint64_t total_ = 0;
  bool has_said_ = false;
};

}  // namespace

// For both threads.
struct CheckpointWriter::State {
  void run(CheckpointFiles files) {
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return stop || next; });
      if (!next) return;
      const Checkpoint checkpoint = std::move(*next);
      lock.unlock();
      std::string why;
      try {
        files.write(checkpoint);
      } catch (const InputError& error) {
        why = error.what();
      }
      lock.lock();
      next.reset();
      if (!why.empty() && !failing) fault = "no checkpoint could be kept: " + why;
      failing = !why.empty();
    }
  }

  mutable std::mutex mutex;  // guards what follows
  std::condition_variable wake;
  std::optional<Checkpoint> next;  // until it is written
  bool stop = false, failing = false;
  std::optional<std::string> fault;
  std::thread thread;
};

CheckpointWriter::CheckpointWriter(const std::string& directory, bool fresh, std::uint64_t step,
                                   std::uint64_t most_bytes, std::uint64_t spare_bytes)
    : state_(std::make_unique<State>()) {
  CheckpointFiles kept(directory, fresh, step, most_bytes, spare_bytes);
  state_->thread = std::thread([&s = *state_, files = std::move(kept)]() mutable { s.run(std::move(files)); });
}

CheckpointWriter::~CheckpointWriter() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stop = true;
  }
  state_->wake.notify_one();
  state_->thread.join();
}

bool CheckpointWriter::is_ready() const {
  const std::lock_guard lock(state_->mutex);
  return !state_->next;
}

void CheckpointWriter::put(Checkpoint checkpoint) {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->next) return;
    state_->next = std::move(checkpoint);
  }
  state_->wake.notify_one();
}

std::optional<std::string> CheckpointWriter::take_fault() {
  const std::lock_guard lock(state_->mutex);
  return std::exchange(state_->fault, std::nullopt);
}

}  // namespace sectio
