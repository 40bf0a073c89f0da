#include "common/mcap/mcap_reader.h"

#include <zstd.h>

#include <algorithm>
#include <utility>

#include "common/core/error.h"
#include "common/delta/bytes.h"
#include "common/mcap/mcap_format.h"

namespace sectio {
namespace {

constexpr std::uint64_t kMostMcapRecordBytes = 1ull << 30;
constexpr std::uint64_t kMostChunkBytes = 1ull << 26;  // unpacked: the largest message is a quarter of it
constexpr std::size_t kRecordHead = 9;                 // opcode, length

// A text of a record; nothing when the record ends before it.
std::optional<std::string> text_in(std::span<const std::uint8_t>& rest) {
  ByteReader in(rest);
  const auto size = in.get<std::uint32_t>();
  if (!in.ok() || size > in.remaining()) return std::nullopt;
  const std::span<const std::uint8_t> text = rest.subspan(4, size);
  rest = rest.subspan(4 + std::size_t{size});
  return std::string(text.begin(), text.end());
}

}  // namespace

bool is_mcap(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kMcapMagic.size()> magic{};
  file.read(magic.data(), magic.size());
  return file && std::ranges::equal(magic, kMcapMagic, {}, [](char c) { return static_cast<std::uint8_t>(c); });
}

McapReader::McapReader(const std::string& path) : file_(path, std::ios::binary | std::ios::ate) {
  if (!file_ || file_.tellg() < 0) throw InputError(path + ": can't be read");
  size_ = static_cast<std::uint64_t>(file_.tellg());
  if (!is_mcap(path)) throw InputError(path + ": not an MCAP file");
  at_ = kMcapMagic.size();
  file_.seekg(static_cast<std::streamoff>(at_));
}

std::optional<McapReader::Message> McapReader::next(const std::string& topic) {
  std::optional<Message> message = next();
  while (message && message->topic != topic) message = next();
  return message;
}

std::optional<McapReader::Message> McapReader::next() {
  while (!broken_) {
    while (const std::optional<Record> record = next_in_chunk()) {
      if (!take(*record)) {
        broken_ = true;
        break;
      }
      if (message_) return std::exchange(message_, std::nullopt);
    }
    if (broken_ || finished_ || !read_more()) break;
  }
  return std::nullopt;
}

bool McapReader::read(std::uint64_t bytes) {
  record_.resize(bytes);
  return static_cast<bool>(file_.read(reinterpret_cast<char*>(record_.data()), static_cast<std::streamsize>(bytes)));
}

std::optional<McapReader::Head> McapReader::read_head() {
  if (size_ - at_ < kRecordHead || !read(kRecordHead)) return std::nullopt;
  ByteReader in(record_);
  const auto op = in.get<std::uint8_t>();
  const auto length = in.get<std::uint64_t>();
  if (length > size_ - at_ - kRecordHead || length > kMostMcapRecordBytes) return std::nullopt;
  return Head{op, length};
}

std::optional<McapReader::Chunk> McapReader::next_chunk() {
  std::optional<Chunk> chunk;
  std::vector<std::uint16_t> channels;
  while (!finished_) {
    file_.seekg(static_cast<std::streamoff>(at_));
    const std::optional<Head> head = read_head();
    if (!head) break;
    const auto op = static_cast<McapOp>(head->op);
    const bool is_message = op == McapOp::message;
    if (is_message || op == McapOp::chunk) {
      constexpr std::size_t kBeforeContent = 16;  // times of a chunk; channel, number and time of a message
      if (chunk || head->length < kBeforeContent || !read(kBeforeContent)) break;
      ByteReader in(record_);
      if (is_message) channels.push_back(in.get<std::uint16_t>()), in.get<std::uint32_t>();
      chunk = Chunk{at_, in.get<std::uint64_t>(), 0, {}};
      chunk->last_ns = is_message ? chunk->first_ns : in.get<std::uint64_t>();
    } else if (op == McapOp::message_index && chunk && head->length >= 2) {
      if (!read(2)) break;
      channels.push_back(ByteReader(record_).get<std::uint16_t>());
    } else if (op == McapOp::channel && (!read(head->length) || !take({head->op, record_}))) {
      break;
    }
    finished_ = op == McapOp::data_end;
    at_ += kRecordHead + head->length;
  }
  if (!chunk) return std::nullopt;
  const auto is_known = [&](std::uint16_t channel) { return topics_.contains(channel); };
  if (channels.empty() || !std::ranges::all_of(channels, is_known))
    chunk->topics = topics_in(chunk->place);
  else
    for (const std::uint16_t channel : channels) chunk->topics.push_back(topics_.at(channel));
  return chunk;
}

// A channel is described in the first chunk with a message of it; a chunk may have no index.
std::vector<std::string> McapReader::topics_in(std::uint64_t place) {
  const std::uint64_t at = at_;
  const bool finished = finished_;
  std::vector<std::string> topics;
  go_to(place);
  for (auto message = next(); message && place_ == place; message = next())
    if (std::ranges::find(topics, message->topic) == topics.end()) topics.push_back(message->topic);
  go_to(at);
  finished_ = finished;
  return topics;
}

// The next record of the file; a chunk is unpacked.
bool McapReader::read_more() {
  broken_ = true;
  const std::optional<Head> head = read_head();
  if (!head || !read(head->length)) return false;
  const auto [op, length] = *head;
  if (op == static_cast<std::uint8_t>(McapOp::chunk)) {
    if (!open_chunk(record_)) {
      chunk_.clear();
      in_chunk_ = 0;
      return false;
    }
  } else if (!take({op, record_})) {
    return false;
  }
  place_ = at_;
  at_ += kRecordHead + length;
  broken_ = false;
  return true;
}

void McapReader::go_to(std::uint64_t place) {
  at_ = place;
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(at_));
  chunk_.clear();
  in_chunk_ = 0;
  message_.reset();
  finished_ = broken_ = false;
}

bool McapReader::open_chunk(std::span<const std::uint8_t> content) {
  constexpr std::size_t kBeforeCompression = 28;  // two times, size, checksum
  if (content.size() < kBeforeCompression) return false;
  ByteReader head(content.subspan(16, 12));
  const auto size = head.get<std::uint64_t>();
  const auto crc = head.get<std::uint32_t>();  // 0: none
  std::span<const std::uint8_t> rest = content.subspan(kBeforeCompression);
  const std::optional<std::string> compression = text_in(rest);
  if (!compression || rest.size() < 8) return false;
  ByteReader length(rest);
  if (length.get<std::uint64_t>() != rest.size() - 8 || size > kMostChunkBytes) return false;
  rest = rest.subspan(8);
  if (compression->empty()) {
    chunk_.assign(rest.begin(), rest.end());
  } else if (*compression == "zstd") {
    if (ZSTD_getFrameContentSize(rest.data(), rest.size()) != size) return false;
    chunk_.resize(size);
    if (ZSTD_decompress(chunk_.data(), chunk_.size(), rest.data(), rest.size()) != size) return false;
  } else {
    return false;
  }
  in_chunk_ = 0;
  return crc == 0 || crc == mcap_crc(chunk_);
}

std::optional<McapReader::Record> McapReader::next_in_chunk() {
  const std::span<const std::uint8_t> rest = std::span(chunk_).subspan(in_chunk_);
  if (rest.empty()) return std::nullopt;
  ByteReader in(rest);
  const auto op = in.get<std::uint8_t>();
  const auto length = in.get<std::uint64_t>();
  if (!in.ok() || length > in.remaining()) {
    broken_ = true;
    return std::nullopt;
  }
  in_chunk_ += kRecordHead + length;
  return Record{op, rest.subspan(kRecordHead, length)};
}

// False for a record that contradicts itself.
bool McapReader::take(const Record& record) {
  std::span<const std::uint8_t> rest = record.content;
  switch (static_cast<McapOp>(record.op)) {
    case McapOp::channel: {
      if (rest.size() < 4) return false;
      const auto id = ByteReader(rest).get<std::uint16_t>();
      rest = rest.subspan(4);
      const std::optional<std::string> topic = text_in(rest);
      if (topic) topics_[id] = *topic;
      return topic.has_value();
    }
    case McapOp::message: {
      constexpr std::size_t kBeforeData = 22;  // channel, number, two times
      if (rest.size() < kBeforeData) return false;
      ByteReader in(rest);
      const auto channel = in.get<std::uint16_t>();
      in.get<std::uint32_t>();
      const auto time_ns = in.get<std::uint64_t>();
      rest = rest.subspan(kBeforeData);
      message_ = Message{topics_[channel], time_ns, {rest.begin(), rest.end()}};
      return true;
    }
    case McapOp::metadata: {
      const std::optional<std::string> name = text_in(rest);
      if (!name || rest.size() < 4) return false;
      rest = rest.subspan(4);
      while (!rest.empty()) {
        const std::optional<std::string> key = text_in(rest);
        const std::optional<std::string> value = key ? text_in(rest) : std::nullopt;
        if (!value) return false;
        metadata_[*name][*key] = *value;
      }
      return true;
    }
    case McapOp::data_end:
      finished_ = true;
      return true;
    default:
      return true;
  }
}

}  // namespace sectio
