// The gateway's copy of the topology of every server's bodies, out of which it serves keyframes: a browser that joins
// costs no server anything. One thread; time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render_client/gateway/mailbox.h"
#include "render_client/replica/keyframe_pull.h"
#include "render_client/replica/replica.h"

namespace sectio {

class SessionCopy {
 public:
  static constexpr std::size_t kMaxServers = 16;  // the oldest goes

  // Validated messages, as a viewer gets them.
  void announce(const SceneInfo& scene);
  void feed(const DeltaMessage& message);
  void feed(KeyframeChunk chunk);
  void feed(const StateHeader& header);  // for the revisions that it names
  void feed(const SessionEnd& end);

  // Requests to the servers for what this copy lacks.
  std::vector<KeyframeRequest> take_requests(double now_s);

  // The scenes of all servers, beginning with the one that was heard last, and the ends of those that have ended,
  // encoded. One that has died may have had the bodies of one that has come since.
  std::vector<SharedBytes> scenes() const;
  std::vector<SharedBytes> ends() const;
  // The chunks of a body as it is, encoded; none when it isn't known, or is at `known_revision`.
  const std::vector<SharedBytes>& keyframe(const KeyframeRequest& request);

  bool knows(std::uint64_t epoch) const { return servers_.contains(epoch); }

 private:
  struct Body {
    std::uint64_t revision = kNoRevision;  // revision of the chunks
    std::vector<SharedBytes> chunks;
  };
  struct Server {
    Replica replica;
    KeyframePull pull;
    std::optional<SessionEnd> end;
    std::vector<Body> bodies;
    std::uint64_t heard = 0;  // number of the last state among those of all servers
  };

  std::map<std::uint64_t, Server> servers_;  // by epoch
  std::uint64_t states_heard_ = 0;
};

}  // namespace sectio
