#include "sim_server/session/input_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cinttypes>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string_view>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/delta/bytes.h"
#include "common/delta/checksum.h"
#include "common/messages/codec.h"

namespace sectio {
namespace {

constexpr std::string_view kInputMagic = "SECTIOI1";
constexpr std::uint64_t kChecksumSeed = 1;
constexpr std::size_t kRecordHeaderBytes = 12;  // size, checksum
constexpr std::uint32_t kMostRecordBytes = 1u << 24;
constexpr std::size_t kContentBeginsAlike = 4;  // the mark in front of a message
constexpr std::uint64_t kIndexedEvery = 256;    // steps
constexpr auto kSyncPeriod = std::chrono::seconds(1);

std::vector<std::uint8_t> as_record(std::span<const std::uint8_t> bytes) {
  ByteWriter out;
  out.put(static_cast<std::uint32_t>(bytes.size()));
  out.put(checksum(kChecksumSeed, bytes));
  out.put_bytes(bytes);
  return out.take();
}

// The content of the record that `read(size)` yields; nothing when it isn't whole.
template <class Read>
std::optional<std::vector<std::uint8_t>> content_of_record(const Read& read) {
  const std::optional<std::vector<std::uint8_t>> header = read(kRecordHeaderBytes);
  if (!header) return std::nullopt;
  ByteReader in(*header);
  const auto size = in.get<std::uint32_t>();
  const auto sum = in.get<std::uint64_t>();
  if (size > kMostRecordBytes) return std::nullopt;
  std::optional<std::vector<std::uint8_t>> bytes = read(size);
  if (!bytes || checksum(kChecksumSeed, *bytes) != sum) return std::nullopt;
  return bytes;
}

// The bytes at the front of `rest`, in turn; nothing when it has fewer.
auto reads(std::span<const std::uint8_t>& rest) {
  return [&rest](std::uint64_t size) -> std::optional<std::vector<std::uint8_t>> {
    if (size > rest.size()) return std::nullopt;
    const auto part = rest.first(size);
    rest = rest.subspan(size);
    return std::vector<std::uint8_t>(part.begin(), part.end());
  };
}

// A record begins there, which says that it is longer.
bool is_cut_short(std::span<const std::uint8_t> rest) {
  if (rest.size() < kRecordHeaderBytes) return true;
  const auto size = ByteReader(rest).get<std::uint32_t>();
  return size <= kMostRecordBytes && size > rest.size() - kRecordHeaderBytes;
}

// A whole record begins at some byte behind the first. All contents begin alike, so few places are tried.
bool holds_record(std::span<const std::uint8_t> rest) {
  const std::vector<std::uint8_t> some = encode(StepInputs());
  const auto begin = std::span(some).first(kContentBeginsAlike);
  for (auto from = rest.begin() + 1;; ++from) {
    from = std::search(from, rest.end(), begin.begin(), begin.end());
    if (from == rest.end()) return false;
    const auto at = static_cast<std::size_t>(from - rest.begin());
    if (at <= kRecordHeaderBytes) continue;
    std::span<const std::uint8_t> there = rest.subspan(at - kRecordHeaderBytes);
    if (content_of_record(reads(there))) return true;
  }
}

template <class Text>
std::optional<InputLogHeader> header_from_json(const Text& text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  try {
    return InputLogHeader{json.at("scene"), json.at("bodies"), json.at("state_hash"), json.value("session", "")};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

std::string to_json(const InputLogHeader& header) {
  return nlohmann::json{{"scene", header.scene},
                        {"bodies", header.bodies},
                        {"state_hash", header.state_hash},
                        {"session", header.session}}
      .dump();
}

std::string input_log_path(const std::string& directory_or_record) {
  return is_mcap(directory_or_record) ? directory_or_record : directory_or_record + "/inputs";
}

bool is_input_log(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string magic(kInputMagic.size(), ' ');
  return is_mcap(path) || (file.read(magic.data(), static_cast<std::streamsize>(magic.size())) && magic == kInputMagic);
}

InputLogReader::InputLogReader(const std::string& path) : path_(path), file_(path, std::ios::binary | std::ios::ate) {
  if (!file_ || file_.tellg() < 0) throw InputError(path + ": can't be read");
  size_ = static_cast<std::uint64_t>(file_.tellg());
  if (!is_input_log(path)) throw InputError(path + ": not a journal of inputs");
  if (is_mcap(path)) {
    open_record();
    return;
  }
  at_ = kInputMagic.size();
  file_.seekg(static_cast<std::streamoff>(at_));
  const auto text = read();
  auto header = text ? header_from_json(*text) : std::nullopt;
  if (!header) throw InputError(path + ": its beginning is damaged");
  header_ = std::move(*header);
}

void InputLogReader::open_record() {
  record_ = std::make_unique<McapReader>(path_);
  pending_ = record_->next(kInputTopic);  // the metadata stand before it
  std::optional<InputLogHeader> header;
  bool has_inputs = false;
  for (const auto& [name, values] : record_->metadata())
    if (values.contains(kRecordHeader)) {
      has_inputs = true;
      header = header_from_json(values.at(kRecordHeader));
    }
  if (record_->metadata().empty() && !pending_)  // each record has some
    throw InputError(path_ + ": its beginning is damaged, or it is no record of a session");
  if (!header && (has_inputs || pending_))
    throw InputError(path_ + ": its beginning is damaged; `sim_server play` shows the rest");
  if (!header) throw InputError(path_ + ": a record without the inputs of a session; `sim_server play` shows it");
  header_ = std::move(*header);
}

std::optional<std::vector<std::uint8_t>> InputLogReader::read() {
  if (record_) {
    std::optional<McapReader::Message> message = std::exchange(pending_, std::nullopt);
    if (!message) message = record_->next(kInputTopic);
    at_ = record_->at();
    if (message) time_ns_ = message->time_ns;
    return message ? std::optional(std::move(message->bytes)) : std::nullopt;
  }
  std::uint64_t end = at_;
  auto bytes = content_of_record([&](std::uint64_t size) -> std::optional<std::vector<std::uint8_t>> {
    if (size > size_ - end) return std::nullopt;
    std::vector<std::uint8_t> part(size);
    if (!file_.read(reinterpret_cast<char*>(part.data()), static_cast<std::streamsize>(size))) return std::nullopt;
    end += size;
    return part;
  });
  if (bytes) at_ = end;
  return bytes;
}

std::optional<StepInputs> InputLogReader::next() {
  const std::uint64_t begin = at_;
  const auto bytes = broken_ ? std::nullopt : read();
  auto inputs = bytes ? decode<StepInputs>(*bytes) : std::nullopt;
  if (inputs && inputs->steps.size() == 1) {
    last_step_ = inputs->steps.front().step;
    return inputs;
  }
  if (!record_) at_ = begin;
  broken_ = true;
  return std::nullopt;
}

bool InputLogReader::seek(std::uint64_t byte) {
  if (record_ || byte < at_ || byte > size_) return false;
  at_ = byte;
  file_.seekg(static_cast<std::streamoff>(at_));
  return true;
}

bool InputLogReader::pass(std::uint64_t byte) {
  while (!record_ && at_ < byte && read()) continue;
  return at_ == byte;
}

std::string InputLogReader::damage() const {
  if (at_ == size_ || is_finished()) return {};
  const std::string damaged = path_ + ": damaged at byte " + std::to_string(at_) + ": ";
  if (!record_) return damaged + "the last " + std::to_string(size_ - at_) + " bytes are not read";
  return damaged + formatted("what follows step %" PRIu64
                             ", at %.2f s, can't be simulated again; `sim_server play` shows what "
                             "is whole of it",
                             last_step_, 1e-9 * static_cast<double>(time_ns_));
}

bool InputLogReader::is_torn() {
  if (record_ || at_ == size_ || size_ - at_ > kRecordHeaderBytes + kMostRecordBytes) return false;
  std::vector<std::uint8_t> rest(size_ - at_);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(at_));
  if (!file_.read(reinterpret_cast<char*>(rest.data()), static_cast<std::streamsize>(rest.size()))) return false;
  if (std::ranges::all_of(rest, [](std::uint8_t byte) { return byte == 0; })) return true;
  return is_cut_short(rest) && !holds_record(rest);
}

std::string InputLogReader::note() const {
  return damage().empty() && record_ && !is_finished() ? path_ + ": " + kNoEnd : damage();
}

struct InputLog::State {
  ~State() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    wake.notify_one();
    if (thread.joinable()) thread.join();
    if (file >= 0) ::close(file);
  }
  void open() {
    file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file < 0) throw InputError(path + ": can't be written: " + std::strerror(errno));
  }
  bool write(std::span<const std::uint8_t> bytes) const {
    std::uint64_t at = size;
    while (!bytes.empty()) {
      const ssize_t written = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(at));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      at += static_cast<std::uint64_t>(written);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return true;
  }
  void begin_to_sync() {
    thread = std::thread([this] {
      std::unique_lock lock(mutex);
      while (!wake.wait_for(lock, kSyncPeriod, [&] { return stop; })) {
        lock.unlock();
        ::fdatasync(file);
        lock.lock();
      }
      ::fdatasync(file);
    });
  }
  void index(std::uint64_t step, std::uint64_t at) {
    if (newest_step == 0 || step % kIndexedEvery == 0) offsets[step] = at;
    newest_step = step;
  }

  std::string path;
  int file = -1;
  bool failed = false;

  std::mutex mutex;  // guards all that follows
  std::condition_variable wake;
  bool stop = false;
  std::uint64_t size = 0;                          // length of the whole records
  std::uint64_t newest_step = 0;                   // newest step among the records
  std::map<std::uint64_t, std::uint64_t> offsets;  // some steps have one
  std::thread thread;
};

InputLog::InputLog(const std::string& path, const InputLogHeader& header) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.path = path;
  s.open();
  if (::ftruncate(s.file, 0) != 0) throw InputError(path + ": can't be written: " + std::strerror(errno));
  const std::string text = to_json(header);
  const std::vector<std::uint8_t> record = as_record({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  std::vector<std::uint8_t> bytes(kInputMagic.begin(), kInputMagic.end());
  bytes.insert(bytes.end(), record.begin(), record.end());
  if (!s.write(bytes)) throw InputError(path + ": can't be written: " + std::strerror(errno));
  s.size = bytes.size();
  s.begin_to_sync();
}

InputLog::InputLog(const std::string& path, std::uint64_t whole_bytes, std::uint64_t known_bytes,
                   std::uint64_t known_steps)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.path = path;
  s.open();
  InputLogReader reader(path);
  s.offsets[1] = reader.whole_bytes();
  if (known_steps > 0 && reader.seek(known_bytes)) s.newest_step = known_steps;
  for (std::uint64_t at = reader.whole_bytes(); at < whole_bytes; at = reader.whole_bytes()) {
    const auto inputs = reader.next();
    if (!inputs) break;
    s.index(inputs->steps.front().step, at);
  }
  s.size = reader.whole_bytes();
  if (::ftruncate(s.file, static_cast<off_t>(s.size)) != 0)
    throw InputError(path + ": can't be shortened to its whole part: " + std::strerror(errno));
  s.begin_to_sync();
}

InputLog::~InputLog() = default;

std::uint64_t InputLog::bytes() const {
  const std::lock_guard lock(state_->mutex);
  return state_->size;
}

std::optional<std::string> InputLog::append(const StepInputs& one_step) {
  State& s = *state_;
  if (s.failed) return std::nullopt;
  const std::vector<std::uint8_t> record = as_record(encode(one_step));
  const std::lock_guard lock(s.mutex);
  if (s.write(record)) {
    s.index(one_step.steps.front().step, s.size);
    s.size += record.size();
    return std::nullopt;
  }
  s.failed = true;
  const std::string why = std::strerror(errno);
  const bool whole = ::ftruncate(s.file, static_cast<off_t>(s.size)) == 0;  // else its end is torn, which readers bear
  return s.path + ": inputs are kept no longer: " + why + (whole ? "" : ", and its last record is torn");
}

std::vector<StepRecord> InputLog::read_from(std::uint64_t first_step, std::size_t most_bytes) {
  State& s = *state_;
  std::vector<StepRecord> records;
  std::uint64_t at = 0, end = 0;
  {
    const std::lock_guard lock(s.mutex);
    auto from = s.offsets.upper_bound(first_step);
    if (from == s.offsets.begin() || first_step > s.newest_step) return records;
    at = std::prev(from)->second;
    end = s.size;
  }
  const auto read = [&](std::uint64_t size) -> std::optional<std::vector<std::uint8_t>> {
    std::vector<std::uint8_t> part(size);
    if (at + size > end || ::pread(s.file, part.data(), size, static_cast<off_t>(at)) != static_cast<ssize_t>(size))
      return std::nullopt;
    at += size;
    return part;
  };
  for (std::size_t bytes = 0; bytes < most_bytes && records.size() < kMaxRecordsPerMessage;) {
    const auto content = content_of_record(read);
    auto inputs = content ? decode<StepInputs>(*content) : std::nullopt;
    if (!inputs || inputs->steps.size() != 1) break;
    if (const std::uint64_t step = inputs->steps.front().step; step < first_step) {
      const std::lock_guard lock(s.mutex);
      if ((step + 1) % kIndexedEvery == 0) s.offsets.emplace(step + 1, at);
      continue;
    }
    bytes += content->size();
    records.push_back(std::move(inputs->steps.front()));
  }
  return records;
}

}  // namespace sectio
