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
constexpr std::size_t kIndexHead = 6, kDataEnd = 4;    // content

// A text of a record; nothing when the record ends before it.
std::optional<std::string> text_in(std::span<const std::uint8_t>& rest) {
  ByteReader in(rest);
  const auto size = in.get<std::uint32_t>();
  if (!in.ok() || size > in.remaining()) return std::nullopt;
  const std::span<const std::uint8_t> text = rest.subspan(4, size);
  rest = rest.subspan(4 + std::size_t{size});
  return std::string(text.begin(), text.end());
}

// An index begins with its channel and the size of the rest. False: its kind or its length is damaged.
bool is_index(std::span<const std::uint8_t> begin, std::uint64_t length) {
  return begin.size() >= kIndexHead && ByteReader(begin.subspan(2)).get<std::uint32_t>() == length - kIndexHead;
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
  at_ = before_ = kMcapMagic.size();
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

// A chunk that is packed says so at a place of its head, which is looked for; what stands around it must agree.
std::optional<std::uint64_t> McapReader::find_chunk(std::uint64_t from) {
  constexpr std::array<std::uint8_t, 8> kPacked{4, 0, 0, 0, 'z', 's', 't', 'd'};
  constexpr std::size_t kBefore = kRecordHead + 28, kHead = kBefore + kPacked.size() + 8;
  constexpr std::size_t kBlock = 1u << 20;
  for (; size_ > from && size_ - from >= kHead; from += kBlock - kHead) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(from));
    if (!read(std::min<std::uint64_t>(kBlock, size_ - from))) return std::nullopt;
    for (auto found = record_.begin();; ++found) {
      found = std::search(found, record_.end(), kPacked.begin(), kPacked.end());
      if (found == record_.end()) break;
      const auto at = static_cast<std::size_t>(found - record_.begin());
      if (at < kBefore || record_.size() - at < kHead - kBefore) continue;
      const std::span<const std::uint8_t> block = record_;
      ByteReader head(block.subspan(at - kBefore)), size(block.subspan(at + kPacked.size()));
      const auto op = head.get<std::uint8_t>();
      const auto length = head.get<std::uint64_t>();
      const std::uint64_t place = from + at - kBefore;
      if (op == static_cast<std::uint8_t>(McapOp::chunk) && length <= size_ - place - kRecordHead &&
          length == size.get<std::uint64_t>() + kHead - kRecordHead)
        return place;
    }
    if (size_ - from <= kBlock) break;
  }
  return std::nullopt;
}

// Goes from a record that contradicts itself, or the one before it, to the next chunk. Without a head, it is the one
// before it whose length is wrong if it reaches beyond that chunk.
bool McapReader::pass_damage(bool has_head) {
  const std::optional<std::uint64_t> place = at_ < size_ ? find_chunk(before_ + 1) : std::nullopt;
  if (!place) return false;
  if (!passed_damage_) passed_damage_ = has_head || *place < at_ ? before_ : at_;
  at_ = before_ = *place;
  return true;
}

// Takes what the head of a chunk, its index or a channel tells. False: the record contradicts itself.
bool McapReader::look_at(const Head& head, std::optional<Chunk>& chunk, std::vector<std::uint16_t>& channels) {
  constexpr std::size_t kBeforeContent = 16;  // times of a chunk; channel, number and time of a message
  const auto op = static_cast<McapOp>(head.op);
  if (op == McapOp::message || op == McapOp::chunk) {
    if (head.length < kBeforeContent || !read(kBeforeContent)) return false;
    ByteReader in(record_);
    if (op == McapOp::message) channels.push_back(in.get<std::uint16_t>()), in.get<std::uint32_t>();
    chunk = Chunk{at_, in.get<std::uint64_t>(), 0, {}};
    chunk->last_ns = op == McapOp::message ? chunk->first_ns : in.get<std::uint64_t>();
  } else if (op == McapOp::message_index) {
    if (head.length < kIndexHead || !read(kIndexHead) || !is_index(record_, head.length)) return false;
    channels.push_back(ByteReader(record_).get<std::uint16_t>());
  } else if (op == McapOp::data_end) {
    return head.length == kDataEnd;
  } else if (op == McapOp::channel) {
    return read(head.length) && take({head.op, record_});
  }
  return true;
}

std::optional<McapReader::Chunk> McapReader::next_chunk() {
  std::optional<Chunk> chunk;
  std::vector<std::uint16_t> channels;
  bool behind_chunk = false;  // nothing but its index since
  while (!finished_) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at_));
    const std::optional<Head> head = read_head();
    const auto op = head ? static_cast<McapOp>(head->op) : McapOp::footer;
    if (chunk && (op == McapOp::message || op == McapOp::chunk)) break;
    const bool is_astray = op == McapOp::message_index && !behind_chunk;
    if (head && !is_astray && look_at(*head, chunk, channels)) {
      behind_chunk = op == McapOp::chunk || op == McapOp::message_index;
      finished_ = op == McapOp::data_end;
      before_ = std::exchange(at_, at_ + kRecordHead + head->length);
    } else if (chunk || !pass_damage(head.has_value())) {
      break;
    }
  }
  if (!chunk) return std::nullopt;
  const auto is_known = [&](std::uint16_t channel) { return topics_.contains(channel); };
  if (channels.empty() || !std::ranges::all_of(channels, is_known))
    chunk->topics = topics_in(chunk->place);
  else
    for (const std::uint16_t channel : channels) chunk->topics.push_back(topics_.at(channel));
  return chunk;
}

// The channels of a chunk may be described in it alone, and it may have no index.
std::vector<std::string> McapReader::topics_in(std::uint64_t place) {
  const std::uint64_t at = at_, before = before_;
  const bool finished = finished_;
  std::vector<std::string> topics;
  go_to(place);
  for (auto message = next(); message && place_ == place; message = next())
    if (std::ranges::find(topics, message->topic) == topics.end()) topics.push_back(message->topic);
  go_to(at);
  before_ = before;
  finished_ = finished;
  return topics;
}

// The next record of the file; a chunk is unpacked.
bool McapReader::read_more() {
  broken_ = true;
  const std::optional<Head> head = read_head();
  if (!head || !read(head->length)) return false;
  const auto [op, length] = *head;
  const bool indexes = op == static_cast<std::uint8_t>(McapOp::message_index);
  if (indexes && !is_index(record_, length)) return false;
  if (indexes && !behind_chunk_) {
    at_ = place_;  // the record before it was a chunk once
    return false;
  }
  behind_chunk_ = indexes || op == static_cast<std::uint8_t>(McapOp::chunk);
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
  at_ = before_ = place;
  behind_chunk_ = false;
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
      const auto topic = topics_.find(channel);
      message_ = Message{topic == topics_.end() ? "" : topic->second, time_ns, {rest.begin(), rest.end()}};
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
      finished_ = rest.size() == kDataEnd;
      return finished_;
    default:
      return true;
  }
}

}  // namespace sectio
