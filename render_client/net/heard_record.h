// The record of a session as a viewer hears it: what goes into the replica, in the form of a server's own record. It
// begins with the keyframes of the bodies as the viewer got to know them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/delta/delta_queue.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/topology.h"
#include "common/record/session_record.h"
#include "render_client/replica/world.h"

namespace sectio {

// One thread.
class HeardRecord {
 public:
  // Throws InputError when the file can't be written.
  HeardRecord(const std::string& path, const std::string& viewer);

  // Valid messages, as they come. Scenes and keyframes are taken from the world instead, which knows what they mean.
  void hear(const DeltaMessage& message);
  void hear(const StateHeader& header);
  void hear(const SceneInfo&) {}
  void hear(const KeyframeChunk&) {}
  template <class Message>
  void hear(const Message& message) {
    wait(message.epoch, qos_of<Message>(), encode(message));
  }

  // After World::frame(): writes what the world has taken over, and the messages that came meanwhile. The record ends
  // where the session begins anew.
  void keep(const World& world);
  // Nothing is kept afterwards. False when not all of it is on the disk; a warning has said so.
  bool finish();

 private:
  static constexpr std::size_t kMostHeldEdits = 1u << 21;   // edits in deltas that the world hasn't taken over
  using BodyKey = std::pair<std::uint64_t, std::uint32_t>;  // epoch, body
  struct Waiting {
    std::uint64_t epoch;
    const TopicQos* topic;
    std::vector<std::uint8_t> bytes;
  };

  void lose(const std::optional<std::string>& fault);
  void wait(std::uint64_t epoch, const TopicQos& topic, std::vector<std::uint8_t> bytes);
  bool advance(const World& world);
  void keep_body(const BodyKey& key, const TriangleMesh& mesh, bool whole);

  std::string path_;
  SessionRecord record_;
  bool ended_ = false, is_whole_ = true;
  std::map<std::uint64_t, std::size_t> scenes_;  // in the record: epoch, number of bodies
  std::map<BodyKey, BodyVersion> versions_;      // in the record
  std::map<BodyKey, DeltaQueue> deltas_;         // heard
  std::vector<Waiting> waiting_;
  std::map<std::uint64_t, double> times_s_;  // by epoch: of the newest state since the last keep()
  double newest_s_ = 0, keyframes_kept_s_ = 0;
};

}  // namespace sectio
