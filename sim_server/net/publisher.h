// Everything that a server tells viewers and hands. It keeps its own copy of the topology, from which it serves
// keyframes to viewers that join late or have lost a delta. One thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "sim_server/net/outbox.h"
#include "sim_server/net/server_endpoints.h"
#include "sim_server/net/state_encoder.h"

namespace sectio {

class Publisher {
 public:
  // `meshes`: the bodies of the scene as they are now. The endpoints outlive it.
  Publisher(ServerEndpoints& endpoints, SceneInfo scene, std::vector<TriangleMesh> meshes, double state_interval_s,
            std::uint32_t chunk_bytes);

  // Tells the scene; again after the program has slept.
  void announce();

  // Contact models first, then topology, then the state that needs it.
  void send(Outbox& batch);

  // Takes requests for keyframes, and sends a few chunks of those that are due.
  void serve_keyframes();
  bool has_chunks_left() const { return !chunks_.empty(); }

  // The last state, then the final versions of the bodies, which it returns.
  SessionEnd send_end(const std::string& reason);

  std::uint64_t writes_refused() const { return writes_refused_; }
  std::size_t copy_bytes() const;  // of topology and positions

 private:
  using Clock = std::chrono::steady_clock;
  struct Shadow {  // of a body: what viewers have been told
    TriangleMesh mesh;
    bool keyframe_wanted = false;
    Clock::time_point keyframe_sent{};
  };

  void add_body(BodyInfo info, TriangleMesh mesh);
  void send_delta(const BodyDelta& delta);
  void send_state();
  void send_status(const Outbox& batch);
  void take_requests();
  void queue_keyframes();
  void send_chunks();
  std::vector<BodyVersion> versions() const;
  template <class Message>
  bool write(const Message& message);

  ServerEndpoints& endpoints_;
  SceneInfo scene_;  // grows with the parts that come off
  const double state_interval_s_;
  const std::uint32_t chunk_bytes_;

  std::vector<Shadow> shadows_;
  StateEncoder encoder_;
  StateSnapshot last_snapshot_;
  bool any_snapshot_ = false;
  bool unsent_snapshot_ = false;
  Clock::time_point state_sent_{};
  std::deque<KeyframeChunk> chunks_;
  Clock::time_point next_status_{};
  std::uint64_t writes_refused_ = 0;
};

}  // namespace sectio
