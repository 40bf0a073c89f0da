// Everything that a server tells viewers and hands. It keeps its own copy of the topology, from which it serves
// keyframes to viewers that join late or have lost a delta. One thread.
//
// Between two states the deltas of a body are merged into one, which goes out before the state that needs it: nobody
// sees what comes and goes in between.
//
// States go out in several streams, the slower the coarser, of which each viewer hears one (kStateRates_hz); a stream
// that nobody hears costs nothing. Off host the pieces of a large state are spread over most of the time until the next
// one, so that they don't fill the queue of a link that bears the stream.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/delta/merged_delta.h"
#include "common/record/session_record.h"
#include "sim_server/net/keyframe_server.h"
#include "sim_server/net/outbox.h"
#include "sim_server/net/server_endpoints.h"
#include "sim_server/net/state_encoder.h"

namespace sectio {

class Publisher {
 public:
  // `meshes`: the bodies of the scene as they are now. `record`: gets everything that is sent. Endpoints and record
  // outlive it.
  Publisher(ServerEndpoints& endpoints, SceneInfo scene, std::vector<TriangleMesh> meshes, double state_interval_s,
            bool off_host, SessionRecord* record = nullptr);

  // Tells the scene; again after the program has slept.
  void announce();

  // Says again what a server has said that died meanwhile: viewers know it, or miss it.
  void repeat(std::span<const BodyDelta> deltas, std::span<const Event> events);

  // Topology first, then the state that needs it.
  void send(Outbox& batch);

  // Takes what viewers ask for and report, and sends a few chunks of the keyframes that are due.
  void serve_viewers();
  // There are chunks or pieces to be sent before long.
  bool has_more_to_send() const;
  std::chrono::steady_clock::time_point last_chunk_sent() const { return keyframes_.last_sent(); }

  // The last state, then the final versions of the bodies, which it returns.
  SessionEnd send_end(const std::string& reason);

  std::uint64_t writes_refused() const { return writes_refused_; }
  std::size_t copy_bytes() const;  // topology and positions

 private:
  using Clock = std::chrono::steady_clock;
  struct Shadow {       // a body as viewers have been told of it
    TriangleMesh mesh;  // with the deltas that are unsent
    bool keyframe_wanted = false;
    MergedDelta unsent = {};
    Clock::time_point unsent_since{};
  };
  struct Stream {
    StateEncoder encoder{0, 0, 0};
    StateEncoder::Fineness fineness = {};
    double interval_s = 0;
    std::uint32_t readers = 0;
    bool unsent = false;  // there is a state that it hasn't sent
    Clock::time_point sent{};
    std::size_t pieces_sent = 0;  // pieces of the last state of the encoder, with those of scalars, that have been sent

    std::size_t pieces() const { return encoder.pieces().size() + encoder.scalar_pieces().size(); }
  };
  struct Report {
    LinkReport report;
    Clock::time_point heard{};
  };

  void add_body(BodyInfo info, TriangleMesh mesh);
  void take(const BodyDelta& delta);
  void send_delta(std::uint32_t body_id);
  void send_deltas();
  void send_old_deltas();
  void send_event(const Event& event);
  void look_for_readers();
  void send_states(bool at_once);
  StateEncoder new_encoder(const Stream& stream) const;
  void send_state(std::size_t channel, bool whole = false);
  void send_pieces(std::size_t channel, std::size_t end);
  void send_pieces_that_are_due(std::size_t channel);
  void send_status(const Outbox& batch);
  void take_requests();
  void take_reports();
  void begin_keyframes();
  std::vector<BodyVersion> versions() const;
  template <class Message>
  bool write(const Message& message, std::size_t channel = 0);
  bool is_heard(std::size_t channel) const { return streams_[channel].readers > 0 || (record_ && channel == 0); }
  void keep_keyframes();

  ServerEndpoints& endpoints_;
  SceneInfo scene_;              // grows with the parts that come off
  SessionRecord* const record_;  // null: none
  const bool off_host_;
  double keyframes_kept_s_ = -1e300;

  std::vector<Shadow> shadows_;
  std::vector<Stream> streams_;  // one a rate
  StateSnapshot last_snapshot_;
  bool any_snapshot_ = false;
  KeyframeServer keyframes_;
  std::map<ProgramId, Report> reports_;  // one a program
  Clock::time_point next_status_{};
  std::uint64_t writes_refused_ = 0;
};

}  // namespace sectio
