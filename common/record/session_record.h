// The record of a session: one file (MCAP) with everything that a server has sent, or that a viewer has heard. Tools of
// others read it by the schemas in it, which are idl/; `sim_server play` shows it.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/dds/qos.h"
#include "common/mcap/mcap_writer.h"
#include "common/mesh/triangle_mesh.h"
#include "common/messages/codec.h"

namespace sectio {

// The metadata of every record have this name.
constexpr const char* kRecordMetadata = "sectio";

constexpr double kKeyframesKeptEvery_s = 10;  // simulated: all bodies, for readers that begin in the middle

class SessionRecord {
 public:
  // Throws InputError when the file can't be written.
  SessionRecord(const std::string& path, const std::map<std::string, std::string>& metadata);

  // Messages that follow are of this simulated time, which ascends. One thread, here and below.
  void set_time(double sim_time_s) { time_ns_ = static_cast<std::uint64_t>(1e9 * sim_time_s); }
  double time_s() const { return 1e-9 * static_cast<double>(time_ns_); }

  template <class Message>
  void add(const Message& message) {
    add(qos_of<Message>(), encode(message));
  }
  void add(const TopicQos& topic, std::span<const std::uint8_t> bytes);
  void add_keyframe(std::uint64_t epoch, std::uint32_t body_id, const TriangleMesh& mesh);

  // A word about why the record ends here, once; nothing while it goes on. Another thread may ask.
  std::optional<std::string> take_fault();
  // Nothing is added afterwards. A word about why not all of it is on the disk, or nothing.
  std::optional<std::string> finish();

 private:
  static constexpr std::size_t kRecordChunkBytes = 1u << 18;  // written in a millisecond: the hand waits meanwhile

  std::string fault() const { return path_ + ": the record ends here: is the disk full?"; }

  std::string path_;
  McapWriter writer_;
  std::map<std::string, std::uint16_t> channels_;  // by topic
  std::uint64_t time_ns_ = 0;
  std::atomic<bool> is_full_ = false;
  bool told_ = false;  // take_fault() has told of it
};

}  // namespace sectio
