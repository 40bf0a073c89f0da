// What a viewer knows of a session: one replica for each server that has a share of its bodies, shown as one world.
//
//  - Every server counts its own steps, bodies and revisions; what belongs to which server is told by its epoch.
//  - A newer server that claims a body which another one has, or comes with another scene, takes that one's place as
//    soon as it can be drawn. Until then the old one stays on the screen: the newcomer may be refused, or never begin.
//  - Bodies stand in the order of the scene, those of one server together, parts that came off behind them.
//  - A frame shows the newest state of every server; of one server it carries one step (replica.h). The first frame
//    waits for a server for every body of the scene, but not longer than kGather_s.
//
// One thread. Knows neither DDS nor GL; time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/messages/chunks.h"
#include "render_client/replica/replica.h"

namespace sectio {

class World {
 public:
  static constexpr double kGather_s = 2;
  static constexpr std::size_t kMaxServers = 64;  // on the screen; and as many that wait for the place of others

  // Messages as from_wire() has validated them; of servers that haven't been announced: dropped.
  void announce(const SceneInfo& scene);
  void feed(DeltaMessage message);
  void feed(KeyframeChunk chunk);
  void feed(StateHeader header);
  void feed(StatePiece piece);
  void feed(const SessionEnd& end);
  bool knows(std::uint64_t epoch) const { return find(epoch) != nullptr; }

  // As Replica::frame(); give the same frame every time.
  bool frame(double now_s, Frame& frame);
  std::vector<KeyframeRequest> take_requests(double now_s);

  std::size_t servers() const { return servers_.size(); }
  // Simulated time between the newest states drawn of any two servers.
  double servers_apart_s() const;
  const SceneInfo* scene() const { return servers_.empty() ? nullptr : &*servers_.front()->replica.scene(); }

  // All in the order of the bodies.
  std::vector<const ReplicaBody*> bodies() const;
  std::vector<std::string> body_names() const;
  // Applies everything at hand and says where the bodies are: for the end of a session.
  std::vector<BodyVersion> catch_up();
  // When every server has said where its bodies end: all of them.
  std::optional<SessionEnd> session_end() const;

  ReplicaCounts counts() const;
  std::size_t bytes() const;  // of the topology and state of all bodies

 private:
  struct Server {
    Replica replica;
    KeyframeAssembler assembler;
    Frame frame;
    bool drawn = false;
    std::optional<SessionEnd> end;

    std::uint64_t epoch() const { return replica.scene()->epoch; }
  };
  using Servers = std::vector<std::unique_ptr<Server>>;

  Server* find(std::uint64_t epoch) const;
  void enter(std::unique_ptr<Server> server);
  bool gathered(double now_s);
  void merge(Frame& frame);

  Servers servers_;                                 // in the order of their first bodies in the scene
  Servers claimants_;                               // announced, but another has their place
  std::map<std::uint64_t, SessionEnd> early_ends_;  // of servers not announced yet, by epoch
  bool changed_ = false;                            // other servers than at the last frame
  bool fresh_ = false;                              // something new since then
  std::optional<double> first_seen_s_;
  bool begun_ = false;
};

}  // namespace sectio
