// Writes MCAP files (https://mcap.dev/spec), which tools of others read: chunks of messages, compressed with zstd, with
// an index at the end. A file that was never finished is torn behind its last chunk; readers take what is before. Each
// chunk names all topics so far, so that it can be read where another one is damaged.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace sectio {

class McapWriter {
 public:
  // `chunk_bytes`: at most this much is held back, and lost when the program dies. A file that is there stays as it was
  // until so much is written. Throws InputError "PATH: why", also when another program writes there.
  explicit McapWriter(const std::string& path, std::size_t chunk_bytes = 1u << 20);
  // Finishes the file.
  ~McapWriter();

  // Adds metadata of the whole file. Call before the first message.
  void add_metadata(const std::string& name, const std::map<std::string, std::string>& values);
  // A topic whose messages are CDR of a struct in IDL. Returns its channel.
  std::uint16_t add_channel(const std::string& topic, const std::string& type, const std::string& idl);
  // `time_ns` ascends. False once the disk is full: the file then ends before, and nothing but this result tells of it.
  bool add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> bytes);
  // Writes what is held back, the index and the end, or leaves everything as it was when nothing was added. False when
  // the disk is full.
  bool finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
