#include "common/mcap/mcap_writer.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/core/error.h"
#include "common/core/write_file.h"
#include "common/delta/bytes.h"
#include "common/mcap/mcap_format.h"
#include "common/mcap/mcap_reader.h"

namespace sectio {
namespace {

constexpr int kZstdLevel = 1;  // a running session has other things to do

void put_magic(ByteWriter& out) {
  for (const std::uint8_t byte : kMcapMagic) out.put(byte);
}

void put_text(ByteWriter& out, std::string_view text) {
  out.put(static_cast<std::uint32_t>(text.size()));
  out.put_bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// A list whose size in bytes stands before it.
void put_sized(ByteWriter& out, const ByteWriter& list) {
  out.put(static_cast<std::uint32_t>(list.bytes().size()));
  out.put_bytes(list.bytes());
}

void put_record(ByteWriter& out, McapOp op, const ByteWriter& content) {
  out.put(static_cast<std::uint8_t>(op));
  out.put(std::uint64_t{content.bytes().size()});
  out.put_bytes(content.bytes());
}

struct TimeRange {
  std::uint64_t first_ns = 0, last_ns = 0;
  bool any = false;
  void add(std::uint64_t time_ns) {
    first_ns = any ? std::min(first_ns, time_ns) : time_ns;
    last_ns = any ? std::max(last_ns, time_ns) : time_ns;
    any = true;
  }
};

}  // namespace

struct McapWriter::State {
  ~State() {
    if (lock >= 0) ::close(lock);
  }
  // Nobody else writes there, and what is there stays until there is something to write.
  void open() {
    lock = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    is_new = lock >= 0;
    if (!is_new) lock = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (lock < 0) throw InputError(path + ": can't be written: " + std::generic_category().message(errno));
    if (!is_new && ::lseek(lock, 0, SEEK_END) > 0 && !is_mcap(path))
      throw InputError(path + ": is there already, and is no record: another --record");
    if (::flock(lock, LOCK_EX | LOCK_NB) != 0) throw InputError(path + ": another program writes there");
  }
  void begin() {
    if (std::exchange(begun, true)) return;
    file.open(path, std::ios::binary | std::ios::trunc);
    at = 0;
    write(beginning);
  }
  void write(const ByteWriter& out) {
    if (!begun) {
      beginning.put_bytes(out.bytes());
      at += out.bytes().size();
      return;
    }
    file.write(reinterpret_cast<const char*>(out.bytes().data()), static_cast<std::streamsize>(out.bytes().size()));
    file.flush();
    if (file) at += out.bytes().size();
    if (file || failed) return;
    failed = true;
    file.close();
    keep_beginning(path, at);
  }
  void write_record(McapOp op, const ByteWriter& content) {
    ByteWriter out;
    put_record(out, op, content);
    write(out);
  }
  void write_chunk();
  void write_summary();

  std::string path;
  int lock = -1;
  bool is_new = false, begun = false;
  ByteWriter beginning;  // until the file has begun
  std::ofstream file;
  std::size_t chunk_bytes = 0;
  std::uint64_t at = 0;
  bool failed = false, finished = false;

  ByteWriter records;  // records of the open chunk: all channels first, for readers that have lost another chunk
  std::size_t channel_bytes = 0;  // how many of the open chunk name topics of earlier chunks
  TimeRange chunk_range, range;
  std::map<std::uint16_t, ByteWriter> index;  // by channel: times and offsets in the chunk

  ByteWriter summary_channels;  // schemas and channels once more
  ByteWriter summary_schemas;
  ByteWriter chunk_indexes, metadata_indexes;
  std::map<std::uint16_t, std::uint64_t> counts;  // messages by channel
  std::uint32_t chunks = 0, metadata = 0;
  std::uint16_t channels = 0;
};

McapWriter::McapWriter(const std::string& path, std::size_t chunk_bytes) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.chunk_bytes = chunk_bytes;
  s.path = path;
  s.open();
  ByteWriter begin, header;
  put_magic(begin);
  s.write(begin);
  put_text(header, "");
  put_text(header, "sectio");
  s.write_record(McapOp::header, header);
}

McapWriter::~McapWriter() {
  finish();
}

void McapWriter::add_metadata(const std::string& name, const std::map<std::string, std::string>& values) {
  State& s = *state_;
  ByteWriter list, content, entry;
  for (const auto& [key, value] : values) {
    put_text(list, key);
    put_text(list, value);
  }
  put_text(content, name);
  put_sized(content, list);
  entry.put(s.at);
  s.write_record(McapOp::metadata, content);
  entry.put(std::uint64_t{content.bytes().size() + 9});
  put_text(entry, name);
  put_record(s.metadata_indexes, McapOp::metadata_index, entry);
  ++s.metadata;
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const std::string& type, const std::string& idl) {
  State& s = *state_;
  const std::uint16_t id = ++s.channels;
  ByteWriter schema, channel;
  schema.put(id);
  put_text(schema, type);
  put_text(schema, "omgidl");
  put_text(schema, idl);
  channel.put(id);
  channel.put(id);
  put_text(channel, topic);
  put_text(channel, "cdr");
  channel.put(std::uint32_t{0});
  for (ByteWriter* out : {&s.records, &s.summary_schemas}) put_record(*out, McapOp::schema, schema);
  for (ByteWriter* out : {&s.records, &s.summary_channels}) put_record(*out, McapOp::channel, channel);
  return id;
}

bool McapWriter::add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> bytes) {
  State& s = *state_;
  if (s.failed || s.finished) return false;
  ByteWriter& index = s.index[channel];
  index.put(time_ns);
  index.put(std::uint64_t{s.records.bytes().size()});
  ByteWriter message;
  message.reserve(22 + bytes.size());  // and GCC 12 warns of nothing
  message.put(channel);
  message.put(static_cast<std::uint32_t>(++s.counts[channel]));
  message.put(time_ns);
  message.put(time_ns);
  message.put_bytes(bytes);
  put_record(s.records, McapOp::message, message);
  s.chunk_range.add(time_ns);
  s.range.add(time_ns);
  if (s.records.bytes().size() >= s.chunk_bytes + s.channel_bytes) s.write_chunk();
  return !s.failed;
}

void McapWriter::State::write_chunk() {
  if (!chunk_range.any) return;
  begin();
  const std::vector<std::uint8_t> raw = records.take();
  records = {};
  records.put_bytes(summary_channels.bytes());
  channel_bytes = summary_channels.bytes().size();
  std::vector<std::uint8_t> packed(ZSTD_compressBound(raw.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), kZstdLevel));
  ByteWriter chunk;
  chunk.put(chunk_range.first_ns);
  chunk.put(chunk_range.last_ns);
  chunk.put(std::uint64_t{raw.size()});
  chunk.put(mcap_crc(raw));
  put_text(chunk, "zstd");
  chunk.put(std::uint64_t{packed.size()});
  chunk.put_bytes(packed);
  const std::uint64_t chunk_at = at;
  write_record(McapOp::chunk, chunk);
  const std::uint64_t chunk_length = at - chunk_at, index_at = at;
  ByteWriter offsets;
  for (const auto& [channel, entries] : index) {
    offsets.put(channel);
    offsets.put(at);
    ByteWriter content;
    content.put(channel);
    put_sized(content, entries);
    write_record(McapOp::message_index, content);
  }
  ByteWriter entry;
  entry.put(chunk_range.first_ns);
  entry.put(chunk_range.last_ns);
  entry.put(chunk_at);
  entry.put(chunk_length);
  put_sized(entry, offsets);
  entry.put(at - index_at);
  put_text(entry, "zstd");
  entry.put(std::uint64_t{packed.size()});
  entry.put(std::uint64_t{raw.size()});
  put_record(chunk_indexes, McapOp::chunk_index, entry);
  ++chunks;
  index.clear();
  chunk_range = {};
}

void McapWriter::State::write_summary() {
  ByteWriter end;
  end.put(std::uint32_t{0});
  write_record(McapOp::data_end, end);
  const std::uint64_t summary_at = at;
  ByteWriter statistics, list, statistics_record;
  statistics.reserve(64);
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts) {
    list.put(channel);
    list.put(count);
    messages += count;
  }
  statistics.put(messages);
  statistics.put(channels);
  statistics.put(std::uint32_t{channels});
  statistics.put(std::uint32_t{0});
  statistics.put(metadata);
  statistics.put(chunks);
  statistics.put(range.first_ns);
  statistics.put(range.last_ns);
  put_sized(statistics, list);
  put_record(statistics_record, McapOp::statistics, statistics);
  ByteWriter offsets;
  const auto group = [&](McapOp op, const ByteWriter& records_of_group) {
    if (records_of_group.bytes().empty()) return;
    ByteWriter offset;
    offset.put(static_cast<std::uint8_t>(op));
    offset.put(at);
    offset.put(std::uint64_t{records_of_group.bytes().size()});
    write(records_of_group);
    put_record(offsets, McapOp::summary_offset, offset);
  };
  group(McapOp::schema, summary_schemas);
  group(McapOp::channel, summary_channels);
  group(McapOp::statistics, statistics_record);
  group(McapOp::chunk_index, chunk_indexes);
  group(McapOp::metadata_index, metadata_indexes);
  ByteWriter footer, last;
  footer.put(summary_at);
  footer.put(at);
  footer.put(std::uint32_t{0});
  write(offsets);
  put_record(last, McapOp::footer, footer);
  put_magic(last);
  write(last);
}

bool McapWriter::finish() {
  State& s = *state_;
  if (s.finished) return !s.failed;
  s.finished = true;
  if (!s.range.any) {
    if (s.is_new) ::unlink(s.path.c_str());
    return true;
  }
  if (!s.failed) s.write_chunk();
  if (!s.failed) s.write_summary();
  return !s.failed;
}

}  // namespace sectio
