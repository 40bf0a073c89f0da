// The server's end of the wire, as the simulation's thread sees it. Three parts, one for each place where they live:
//
//   Intake     simulation's thread: poses and requests come in
//   Handover   between both threads, under its lock
//   Publisher  network's thread: writes to DDS what was put down, and serves keyframes from its own copies
//
// The simulation never waits for the network: publish() copies what is due into a bounded outbox.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/dds/participant.h"
#include "common/messages/session.h"
#include "sim_server/net/other_servers.h"
#include "sim_server/net/outbox.h"

namespace sectio {

struct ServerNetOptions {
  NetworkOptions network;
  double state_rate_hz = 60;
  std::uint64_t epoch = 0;  // 0: microseconds since 1970, so that a server started later has a higher one
};

class ServerNet {
 public:
  // Announces the scene. No world_bodies: the bodies of this server are all. `meshes`: the bodies as they are now.
  // Throws InputError for bad options, and for names, colours or a camera that viewers would refuse.
  ServerNet(const ServerNetOptions& options, SceneInfo scene, std::vector<TriangleMesh> meshes);
  ~ServerNet();

  // Appends the samples that have arrived since the last call, each once, in order of sequence for each tool. Damaged
  // ones are dropped and counted. A program that was asleep joins its session anew here. Simulation's thread; never
  // blocks.
  void take_samples(std::vector<ToolSample>& samples);

  // The gravity that somebody asks for, once a request. Simulation's thread; never blocks.
  std::optional<Vec3> take_gravity();

  // Simulation's thread; never waits for the network. Deltas, events and contact models always; the state at the
  // state's rate, or at once with publish_now.
  void publish(const StepOutput& output, const WorldView& world, double step_wall_time_s);

  // Sends all that is left, then the final versions of the bodies, which it returns.
  SessionEnd end_session(const std::string& reason);

  // The other servers of the session, when several share its bodies.
  const OtherServers& others() const;

  // After end_session(): the size of the network's copy of the bodies, and how long the network's thread was at work.
  std::size_t copy_bytes() const;
  double busy_s() const;

  // Viewers that are connected now.
  std::uint32_t viewers() const;
  // Viewers that fell silent without a word and have not come back.
  std::uint32_t lost_viewers() const;
  // Serves all of them until the last one has left or the time is over; true for the former.
  bool wait_for_viewers_to_leave(double timeout_s);

  std::uint64_t epoch() const;
  std::uint64_t writes_refused() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
