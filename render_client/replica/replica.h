// A viewer's copy of the bodies, fed with what arrives in whatever order, with losses. It decides what may be drawn:
//
//  - A state is drawn on the topology of its own revision only. Deltas wait, by revision, until a state needs them.
//  - A vertex whose slot changed at revision b is drawn at a position that was sent at revision b or later.
//  - A frame carries one step: the newest whose pieces have all come. When none has for kPatience_s, vertices whose
//    piece was lost are drawn at their last position.
//  - A gap or a hash mismatch asks for a keyframe; meanwhile the caller keeps drawing the frame it has.
//
// Memory is bounded whatever arrives. One thread. Knows neither DDS nor GL; time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/topology.h"
#include "render_client/replica/frame.h"
#include "render_client/replica/replica_body.h"

namespace sectio {

class Replica {
 public:
  static constexpr double kPatience_s = 0.1;          // before a frame is patched, or a late delta counts as lost
  static constexpr double kRequestInterval_s = 0.25;  // between requests for one body; doubles with each in vain
  static constexpr double kMaxRequestInterval_s = 4;
  static constexpr std::size_t kMaxHeaders = 64;

  // Begins anew: another server, or another scene.
  void reset(const SceneInfo& scene);
  // The same session with more bodies than before: parts that came off. What is known of the others stays.
  void extend(const SceneInfo& scene);
  const std::optional<SceneInfo>& scene() const { return scene_; }

  // Messages as from_wire() has validated them. Of another epoch, or about what the scene doesn't have: dropped.
  void feed(DeltaMessage message);
  void feed_keyframe(std::uint64_t epoch, std::uint32_t body_id, std::span<const std::uint8_t> bytes);
  void feed(StateHeader header);
  void feed(StatePiece piece);
  // Where the bodies must end; a replica that can't get there asks for keyframes.
  void feed(const SessionEnd& end);

  // The newest state that may be drawn, when there is one newer than the last. A frame given back is refilled: topology
  // is copied only where its revision differs. False: `frame` is as before. `now_s` ascends, by any clock.
  bool frame(double now_s, Frame& frame);

  // The bodies whose keyframe is to be asked for now; `client` is left to the caller.
  std::vector<KeyframeRequest> take_requests(double now_s);

  // Applies everything at hand, drawn or not, and says where the bodies are: for the end of a session.
  std::vector<BodyVersion> catch_up();

  const ReplicaCounts& counts() const { return counts_; }
  const std::vector<ReplicaBody>& bodies() const { return bodies_; }

 private:
  struct Asking {
    std::uint64_t wanted_revision = 0;  // the newest that a state or the session's end has named
    std::optional<double> starved_since_s;
    double next_s = 0;
    double interval_s = kRequestInterval_s;
  };

  bool ours(std::uint64_t epoch) const { return scene_ && scene_->epoch == epoch; }
  bool reachable(const StateHeader& header) const;
  bool complete(const StateHeader& header) const;
  bool prepare(const StateHeader& header);
  void fill(const StateHeader& header, Frame& frame);

  std::optional<SceneInfo> scene_;
  std::vector<ReplicaBody> bodies_;
  std::vector<Asking> asking_;
  bool ended_ = false;
  std::map<std::uint64_t, StateHeader> headers_;  // by step; newer than the last frame
  std::optional<std::uint64_t> settled_step_;
  std::optional<double> waiting_since_s_;  // since when there has been something newer than the last frame
  ReplicaCounts counts_;
};

}  // namespace sectio
