// Reads MCAP files (https://mcap.dev/spec) from their beginning: messages in the order of the file, whatever its index
// says, so that a file that was never finished is read as far as it is whole. Chunks are plain or compressed with zstd.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace sectio {

bool is_mcap(const std::string& path);

// A word about a file that is whole as far as it goes, and was never finished.
constexpr const char* kNoEnd = "it has no end: its writer was killed, its disk was full, or the rest is missing";

class McapReader {
 public:
  struct Message {
    std::string topic;
    std::uint64_t time_ns = 0;
    std::vector<std::uint8_t> bytes;
  };

  // Throws InputError "PATH: why" when it is no MCAP file.
  explicit McapReader(const std::string& path);

  // The next message, or the next one of a topic; nothing at the end and where the file is damaged.
  std::optional<Message> next();
  std::optional<Message> next(const std::string& topic);
  // The place in the file of the last message, or of the chunk that it is in; and back to a place that has been read.
  std::uint64_t place() const { return place_; }
  void go_to(std::uint64_t place);
  // The next chunk, or message outside of chunks, by its head and the index behind it: it is passed, and go_to() leads
  // back to it. Looks for the next one where the file is damaged between chunks. Nothing at the end.
  struct Chunk {
    std::uint64_t place = 0, first_ns = 0, last_ns = 0;
    std::vector<std::string> topics;  // its messages have these; none when it is damaged and nothing before names them
  };
  std::optional<Chunk> next_chunk();
  // The place of the first damage that next_chunk() has passed.
  const std::optional<std::uint64_t>& passed_damage() const { return passed_damage_; }
  // The metadata that stand before the messages read so far, by name.
  const std::map<std::string, std::map<std::string, std::string>>& metadata() const { return metadata_; }
  // The end of the part that has been read, and whether the file ends there as it should.
  std::uint64_t at() const { return at_; }
  bool is_finished() const { return finished_; }
  std::uint64_t size() const { return size_; }

 private:
  struct Record {
    std::uint8_t op = 0;
    std::span<const std::uint8_t> content;
  };
  struct Head {
    std::uint8_t op = 0;
    std::uint64_t length = 0;
  };
  bool read(std::uint64_t bytes);
  std::optional<Head> read_head();
  bool look_at(const Head& head, std::optional<Chunk>& chunk, std::vector<std::uint16_t>& channels);
  bool pass_damage(bool has_head);
  std::vector<std::string> topics_in(std::uint64_t place);
  std::optional<std::uint64_t> find_chunk(std::uint64_t from);
  bool read_more();
  bool open_chunk(std::span<const std::uint8_t> content);
  bool take(const Record& record);
  std::optional<Record> next_in_chunk();

  std::ifstream file_;
  std::uint64_t size_ = 0, at_ = 0, place_ = 0, before_ = 0;  // before_: the record that ends at at_, or at_
  bool finished_ = false, broken_ = false;
  bool behind_chunk_ = false;  // nothing but its index since
  std::optional<std::uint64_t> passed_damage_;
  std::vector<std::uint8_t> record_;  // the file's record at hand
  std::vector<std::uint8_t> chunk_;   // unpacked
  std::size_t in_chunk_ = 0;
  std::map<std::uint16_t, std::string> topics_;
  std::map<std::string, std::map<std::string, std::string>> metadata_;
  std::optional<Message> message_;
};

}  // namespace sectio
