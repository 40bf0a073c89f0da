// A viewer's knowledge of a session: one replica for each server that has a share of its bodies, shown as one world.
//
//  - Every server counts its own steps, bodies and revisions. The epoch of a message says which server sent it.
//  - A server that sends states keeps its place. A newcomer that claims a body of another server, or announces another
//    scene, takes that server's place once the newcomer can be drawn and the other server has ended or been silent for
//    kSilence_s: until then the newcomer may be refused, or never begin. A server that lost its place gets it back in
//    the same way.
//  - A server that takes over the session of another (common/messages/epoch.h) has its place at once, and goes on with
//    its bodies; when it falls silent while the former server still speaks, that one has it back.
//  - Bodies stand in the order of the scene, those of one server together, parts that came off behind them.
//  - A frame shows the newest state of every server; of one server it carries one step (replica.h). The first frame
//    waits for a server for every body of the scene, but not longer than kGather_s.
//
// One thread. Knows neither DDS nor GL; time is passed in.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render_client/replica/keyframe_pull.h"
#include "render_client/replica/replica.h"

namespace sectio {

class World {
 public:
  static constexpr double kGather_s = 2;
  static constexpr double kSilence_s = 0.5;       // states come sixty times a second
  static constexpr double kGone_s = 10;           // a server that was silent for so long has died, if others have ended
  static constexpr std::size_t kMaxServers = 64;  // shown; and as many claimants

  // Validated messages. Messages of a server that hasn't been announced are dropped.
  void announce(const SceneInfo& scene);
  void feed(DeltaMessage message);
  void feed(KeyframeChunk chunk);
  void feed(StateHeader header);
  void feed(StatePiece piece);
  void feed(ScalarPiece piece);
  void feed(const SessionEnd& end);
  // The server is there, though it may send no states, as in a pause.
  void feed(const ServerStatus& status);
  bool knows(std::uint64_t epoch) const { return find(epoch) != nullptr; }
  // The server is one of those whose bodies are drawn; others wait for the place of one of these.
  bool shows(std::uint64_t epoch) const;
  bool has_ended(std::uint64_t epoch) const;

  // See Replica::frame(). Callers pass the same frame every time.
  bool frame(double now_s, Frame& frame);
  std::vector<KeyframeRequest> take_requests(double now_s);

  std::size_t servers() const { return servers_.size(); }
  // Simulated time between the newest states drawn of any two servers.
  double servers_apart_s() const;
  const SceneInfo* scene() const { return servers_.empty() ? nullptr : &*servers_.front()->replica.scene(); }

  // The replica of one server; null when it hasn't been announced.
  const Replica* replica_of(std::uint64_t epoch) const;
  // Epoch and number of bodies of the servers that are shown, in the order of the bodies.
  std::vector<std::pair<std::uint64_t, std::size_t>> body_counts() const;

  // The results of all three are in the order of the bodies.
  std::vector<const ReplicaBody*> bodies() const;
  std::vector<std::string> body_names() const;
  // Applies everything at hand and returns the versions that the bodies have reached: for the end of a session.
  std::vector<BodyVersion> catch_up();
  // The final versions of all bodies, once every server has announced its own.
  std::optional<SessionEnd> session_end() const;
  // The bodies of servers that have died, once all others have ended: nobody will tell the end of these. Else empty.
  std::string left_by(double now_s) const;

  bool knows_all_bodies() const;     // at some revision
  std::size_t pulled_bytes() const;  // keyframes that are coming
  ReplicaCounts counts() const;
  std::size_t bytes() const;  // topology and state of all bodies

 private:
  // Whether somebody sends states.
  struct Hearing {
    bool fresh = false;  // one has come since the last frame
    double last_s = -1e300;

    void look(double now_s) {
      if (std::exchange(fresh, false)) last_s = now_s;
    }
    bool is_silent(double now_s) const { return now_s - last_s > kSilence_s; }
  };
  struct Server {
    Replica replica;
    KeyframePull pull;
    Frame frame;
    bool drawn = false;
    double known_s = 1e300;  // the first frame() after it was announced
    Hearing of_status;
    Hearing hearing;
    std::optional<SessionEnd> end;
    std::uint64_t former_epoch = 0;  // epoch of the server that had the session before
    Hearing of_former;

    std::uint64_t epoch() const { return replica.scene()->epoch; }
    bool is_silent(double now_s) const { return hearing.is_silent(now_s); }
    bool speaks(double now_s) const { return !end && last_word_s() > now_s - kGone_s; }
    double last_word_s() const { return std::max({hearing.last_s, of_status.last_s, known_s}); }
  };
  using Servers = std::vector<std::unique_ptr<Server>>;

  Server* find(std::uint64_t epoch) const;
  bool hand_over(const SceneInfo& scene);
  void adopt(Server& server, const SceneInfo& scene);
  void give_back(Server& server, double now_s);
  void add_claimant(std::unique_ptr<Server> server);
  void show(std::unique_ptr<Server> server);
  void promote_claimants(double now_s);
  bool gathered(double now_s);
  void merge(double now_s, Frame& frame);

  Servers servers_;                                 // in the order of their first bodies in the scene
  Servers claimants_;                               // announced, but another server has their place
  std::map<std::uint64_t, SessionEnd> early_ends_;  // servers that aren't announced yet, by epoch
  bool changed_ = false;                            // the servers are others than at the last frame
  std::uint64_t arrangement_ = 0;                   // counts these changes
  bool fresh_ = false;                              // there is something new to draw
  std::optional<double> first_seen_s_;
  bool begun_ = false;
};

}  // namespace sectio
