// How the keyframes of one server's bodies come to a viewer: chunks, pulled in windows. A window is asked for when half
// of the one before has come; it grows while windows come fast, and shrinks when they take long, so that the queue of a
// thin link holds no more than a fraction of a second. One thread; time is passed in.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/messages/chunks.h"
#include "common/messages/session.h"
#include "render_client/replica/replica.h"

namespace sectio {

class KeyframePull {
 public:
  static constexpr double kStall_s =
      1;  // without a chunk, the missing ones are asked for again; twice as long: forgotten
  static constexpr std::size_t kMostWindowBytes = 128 << 10;

  // The whole keyframe when this chunk was the last one missing. Chunks of another revision than the one that is coming
  // are dropped: they are for another viewer.
  std::optional<std::vector<std::uint8_t>> add(KeyframeChunk chunk);

  // A keyframe of the body is coming.
  bool is_coming(std::uint32_t body_id) const { return pulls_.contains(body_id); }

  // The next windows of the bodies that still want their keyframe, as requests without epoch and client.
  std::vector<KeyframeRequest> take_requests(double now_s, const std::function<bool(std::uint32_t)>& wanted);

  std::size_t bytes() const { return assembler_.bytes(); }

 private:
  struct Pull {
    std::uint64_t revision = 0;
    std::uint32_t total = 0, came = 0;
    std::uint32_t asked = kFirstWindow;  // chunks before this one have been asked for
    std::uint32_t window = kFirstWindow;
    std::size_t chunk_bytes = 0;
    double asked_s = -1;
    double came_s = -1;  // the last chunk; negative: since the last look
    int stalls = 0;
  };

  void widen_or_narrow(Pull& pull, double now_s);

  KeyframeAssembler assembler_;
  std::map<std::uint32_t, Pull> pulls_;  // by body_id
};

// The requests that are due now: for keyframes that the replica lacks, and for the next windows of those that are
// coming. The caller fills in `client`.
std::vector<KeyframeRequest> keyframe_requests(Replica& replica, KeyframePull& pull, double now_s);

}  // namespace sectio
