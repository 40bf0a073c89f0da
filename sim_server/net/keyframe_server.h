// The keyframes that viewers pull: the chunks of the last few, in the windows that were asked for, and no faster than
// what leaves the wire free for states and hands. Programs that ask are served in turn, a chunk at a time, so that one
// that asks for very much holds up no other. One thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "common/core/token_bucket.h"
#include "common/mesh/triangle_mesh.h"
#include "common/messages/epoch.h"
#include "common/messages/topology.h"

namespace sectio {

class KeyframeServer {
 public:
  static constexpr double kInterval_s = 0.1;       // at most one a body; requests in between are served together
  static constexpr double kMostBytes_per_s = 4e6;  // off host, of all keyframes together

  KeyframeServer(std::uint64_t epoch, bool off_host);

  // Begins a keyframe of the body as it is. False when it is too soon after the last one.
  bool begin(std::uint32_t body_id, const TriangleMesh& mesh);
  // The next window of a keyframe that has begun. False when it is not at hand any more: begin another.
  bool go_on(const KeyframeRequest& request, const ProgramId& program);

  // Sends a few of the chunks that are due. Returns the bodies whose last chunk is among them.
  std::vector<std::uint32_t> send_chunks(const std::function<bool(const KeyframeChunk&)>& write);
  bool has_chunks_left() const { return !askers_.empty(); }
  std::chrono::steady_clock::time_point last_sent() const { return sent_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Chunk {
    KeyframeChunk chunk;
    Clock::time_point sent{};
  };
  struct Served {
    std::uint32_t body_id = 0;
    std::uint64_t revision = 0;
    std::vector<Chunk> chunks;
    Clock::time_point begun{}, asked{};
  };
  struct Window {
    std::uint32_t body_id = 0;
    std::uint64_t revision = 0;
    std::uint32_t next = 0, end = 0;
  };
  struct Asker {
    ProgramId program{};
    std::deque<Window> windows;
  };

  Served* find(std::uint32_t body_id, std::uint64_t revision);
  void forget_old();
  bool may_send(std::size_t bytes);
  Asker* asker_of(const ProgramId& program);
  Chunk* next_chunk(Asker& asker);

  const std::uint64_t epoch_;
  const bool off_host_;
  std::vector<Served> served_;
  std::deque<Asker> askers_;  // the one whose turn it is first; none without windows
  TokenBucket bytes_;
  Clock::time_point sent_{};
};

}  // namespace sectio
