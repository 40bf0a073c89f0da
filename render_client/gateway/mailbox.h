// Messages that wait for one client. Changes of topology and events go in order, and none is left out; of whatever
// has only a present value, a newer one replaces the one that still waits. So a client that reads slowly gets the
// newest state, as often as it can take it, and costs a bounded piece of memory. One thread.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/messages/codec.h"
#include "common/messages/live_frame.h"

namespace sectio {

using SharedBytes = std::shared_ptr<const std::vector<std::uint8_t>>;

// A message as CDR, encoded once for all clients.
template <class Message>
SharedBytes shared(const Message& message) {
  return std::make_shared<const std::vector<std::uint8_t>>(encode(message));
}

// The subject of a message: of two messages with the same one, the newer replaces the older.
struct Subject {
  LiveKind kind = LiveKind::status;
  std::uint64_t epoch = 0;
  std::uint32_t body_or_tool = 0;
  std::uint32_t piece = 0;
  std::string name = {};
  auto operator<=>(const Subject&) const = default;  // NOLINT(modernize-use-nullptr)
};

class Mailbox {
 public:
  static constexpr std::size_t kMaxOrderedBytes = 8u << 20;
  static constexpr std::size_t kFrameBytes = 1u << 16;  // a frame is no larger, unless one message is

  // Beyond kMaxOrderedBytes all changes of topology that wait are dropped: the client notices the gap, and asks for a
  // keyframe.
  void post(LiveKind kind, SharedBytes message);
  void post_newest(Subject subject, SharedBytes message);

  // Fills `frame` with the next messages; false when none waits.
  bool take(std::vector<std::uint8_t>& frame);
  bool is_empty() const { return ordered_.empty() && round_.empty() && next_round_.empty(); }

  // Whether the keyframe of a body waits already.
  bool holds_keyframe(std::uint64_t epoch, std::uint32_t body_id) const;
  void post_keyframe(std::uint64_t epoch, std::uint32_t body_id, const std::vector<SharedBytes>& chunks);

  std::uint64_t replaced() const { return replaced_; }  // states that newer ones replaced
  std::uint64_t dropped() const { return dropped_; }    // changes of topology

 private:
  struct Ordered {
    LiveKind kind;
    SharedBytes message;
    std::uint64_t epoch = 0;  // epoch of a keyframe chunk
    std::uint32_t body_id = 0;
  };

  void drop_topology();

  std::deque<Ordered> ordered_;
  std::size_t ordered_bytes_ = 0;
  // All that waited when the round began goes out before anything that came later: no piece of a body starves.
  std::map<Subject, SharedBytes> round_, next_round_;
  std::uint64_t replaced_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace sectio
