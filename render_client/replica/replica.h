// A viewer's copy of one server's bodies. Messages may arrive in any order, and some may be lost. The replica decides
// what may be drawn:
//
//  - A state is drawn on the topology of its own revision only. Deltas wait, by revision, until a state needs them.
//  - A vertex whose slot changed at revision b is drawn at a position that was sent at revision b or later.
//  - A frame carries one step: the newest step whose pieces have all come. When no step has been complete for
//    kPatience_s, the vertices of lost pieces are drawn at their last positions.
//  - After a gap or a hash mismatch the replica asks for a keyframe; meanwhile the caller keeps drawing the last frame.
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
  static constexpr double kRequestInterval_s = 0.25;  // between requests for one body; doubles with each futile one
  static constexpr double kMaxRequestInterval_s = 4;
  static constexpr double kMostLost_s = 0.5;  // a session that goes on loses no more; else it begins anew
  static constexpr std::size_t kMaxHeaders = 64;
  static constexpr std::size_t kMaxWaitingBytes = 64u << 20;  // all messages that wait; more are dropped

  // Forgets everything and begins with this scene.
  void reset(const SceneInfo& scene);
  // Takes over a list of bodies that has grown by parts that came off. The bodies before them stay as they are.
  void extend(const SceneInfo& scene);
  // Another server has taken this one's session over (common/messages/epoch.h): bodies, revisions and steps go on, and
  // messages of the one before are ghosts. A body of which the new server doesn't know as much is begun anew.
  void adopt(const SceneInfo& scene);
  // For a replica that draws nothing: which revisions its bodies have by now, and with the first state of a new server
  // what it has in common with the one before. feed(StateHeader) does this, too.
  void follow(const StateHeader& header);
  const std::optional<SceneInfo>& scene() const { return scene_; }

  // Validated messages. Messages of another epoch, or about bodies that the scene doesn't have, are dropped.
  void feed(DeltaMessage message);
  void feed_keyframe(std::uint64_t epoch, std::uint32_t body_id, std::span<const std::uint8_t> bytes);
  void feed(StateHeader header);
  void feed(StatePiece piece);
  void feed(ScalarPiece piece);
  // The final versions of the bodies; a replica that can't reach them asks for keyframes.
  void feed(const SessionEnd& end);

  // Fills `frame` with the newest state that may be drawn. False, and `frame` is as before, when there is none newer
  // than the last one. Topology is copied only where the revision differs. `now_s` ascends, by any clock.
  bool frame(double now_s, Frame& frame);

  // Requests for keyframes that are due now; the caller fills in `client`.
  std::vector<KeyframeRequest> take_requests(double now_s);

  // Whether the last call of take_requests() found that the body lacks a keyframe.
  bool wants_keyframe(std::uint32_t body_id) const {
    return body_id < recoveries_.size() && recoveries_[body_id].starved_since_s.has_value();
  }

  // Applies everything at hand, drawn or not, and returns the versions that the bodies have reached: for the end of a
  // session.
  std::vector<BodyVersion> catch_up();

  const ReplicaCounts& counts() const { return counts_; }
  const std::vector<ReplicaBody>& bodies() const { return bodies_; }

 private:
  struct Recovery {
    std::uint64_t wanted_revision = 0;  // the newest one that a state or the session's end has named
    std::optional<double> starved_since_s;
    double next_s = 0;
    double interval_s = kRequestInterval_s;
  };

  bool is_of_this_server(std::uint64_t epoch) const { return scene_ && scene_->epoch == epoch; }
  bool has_room() const;
  bool reachable(const StateHeader& header) const;
  bool complete(const StateHeader& header) const;
  bool prepare(const StateHeader& header);
  void fill(const StateHeader& header, Frame& frame);
  void go_back_to(const StateHeader& header);

  std::optional<SceneInfo> scene_;
  std::vector<ReplicaBody> bodies_;
  std::vector<Recovery> recoveries_;  // one a body
  bool ended_ = false;
  bool adopted_ = false;                          // it has adopted a scene, and no state of the new server has come yet
  std::map<std::uint64_t, StateHeader> headers_;  // newer than the last frame, by step
  std::size_t largest_header_bytes_ = 0;          // so far
  std::optional<std::uint64_t> drawn_step_;
  std::optional<double> waiting_since_s_;  // since then a state newer than the last frame has been waiting
  ReplicaCounts counts_;
};

}  // namespace sectio
