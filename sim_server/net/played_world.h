// The world of a record, as its messages tell of it up to a moment: the bodies of all servers that it has heard, one
// after the other. Knows neither DDS nor a clock.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/mcap/mcap_reader.h"
#include "common/messages/chunks.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "sim_server/net/outbox.h"

namespace sectio {

class PlayedWorld {
 public:
  // The messages of a record in their order; damaged ones are left out.
  void take(const McapReader::Message& message);

  // There are a state and the topology of every body.
  bool can_be_shown() const;
  // A state has come since the last forget_news(): the news can be shown.
  bool has_new_state() const { return has_new_state_; }
  // A body has changed otherwise than by deltas: its viewers must begin anew.
  bool has_jumped() const { return has_jumped_; }
  // Deltas, events and report since the last forget_news(), with the newest state.
  const StepOutput& news() const { return news_; }
  // Viewers must learn of all bodies anew.
  void begin_elsewhere() { has_jumped_ = true; }
  void forget_news();
  void forget_deltas();  // viewers get the bodies as a whole

  SceneInfo scene() const;  // all bodies; without an epoch
  std::vector<TriangleMesh> meshes() const;
  // Valid until the next take().
  const WorldView& view();
  // True when a body isn't the one with which the record ends.
  bool differs_from_end() const;

 private:
  struct Server {
    KeyframeAssembler assembler;
    std::vector<std::uint32_t> bodies;  // by its own body_id
  };
  struct Body {
    BodyInfo info;
    TriangleMesh mesh;
    bool is_known = false;
    std::map<std::uint32_t, StatePiece> early;  // pieces that came before the topology, the newest of each
    // One entry a vertex slot.
    std::vector<Vec3f> positions_world_m;
    std::vector<std::uint64_t> changed_at;  // revision of the slot's last change
    std::vector<bool> is_placed;            // since then
    std::map<std::string, ScalarField> scalars;
    std::vector<std::string> shown_scalars;  // scalars that the newest state names
  };

  void take(const SceneInfo& scene);
  void take(KeyframeChunk chunk);
  void take(const DeltaMessage& message);
  void take(const StateHeader& header);
  void take(const StatePiece& piece);
  void take(const ScalarPiece& piece);
  void take(const SessionEvent& event);
  void take(const ServerStatus& status);
  void take(const SessionEnd& end);
  template <class Message>
  bool take_if(const McapReader::Message& message);
  // The body that a server means; null: it isn't known.
  Body* find(std::uint64_t epoch, std::uint32_t body_id, std::uint32_t& index);
  static void make_room(Body& body);
  static void place(Body& body, const StatePiece& piece);
  static void place_all(Body& body);

  SceneInfo scene_;
  std::map<std::uint64_t, Server> servers_;  // by the beginning of their session
  std::vector<Body> bodies_;
  std::map<std::uint32_t, BodyVersion> ends_;  // with which the record ends, by body
  StepOutput news_;
  WorldView view_;
  bool has_state_ = false, has_new_state_ = false, has_jumped_ = false;
};

}  // namespace sectio
