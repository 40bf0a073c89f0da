// The server's end of the wire. The simulation never waits for it: publish() copies what is due into a bounded outbox,
// and one thread writes that to DDS, serves keyframes from its own copy of the topology, and answers late joiners.
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
  // Announces the scene; no world_bodies: ours are all. `meshes`: the bodies as they are now. Throws InputError for
  // options and names that won't do.
  ServerNet(const ServerNetOptions& options, SceneInfo scene, std::vector<TriangleMesh> meshes);
  ~ServerNet();

  // Appends the samples that have arrived since the last call, each once, in order of sequence for each tool. Damaged
  // ones are dropped and counted. Simulation's thread; never blocks.
  void take_samples(std::vector<ToolSample>& samples);

  // Where somebody wants gravity to turn, once a request. Simulation's thread; never blocks.
  std::optional<Vec3> take_gravity();

  // Simulation's thread; never waits for the network. Deltas, events and contact models always; the state at the
  // state's rate, or at once with publish_now.
  void publish(const StepOutput& output, const WorldView& world, double step_wall_time_s);

  // Sends all that is left, then the final versions of the bodies, which it returns.
  SessionEnd end_session(const std::string& reason);

  // Of the session, when several servers share its bodies.
  const OtherServers& others() const;

  // After end_session(): what the network's thread holds of the bodies, and how long it was at work.
  std::size_t copy_bytes() const;
  double busy_s() const;

  // Viewers that are connected now.
  std::uint32_t viewers() const;
  // Those that went silent without a word and have not come back.
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
