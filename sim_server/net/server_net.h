// The server's end of the wire, as the simulation's thread sees it. Three parts, one for each place where they live:
//
//   Intake     simulation's thread: poses and requests come in
//   Handover   between both threads, under its lock
//   Publisher  network's thread: writes to DDS what was put down, and serves keyframes from its own copies
//
// The simulation never waits for the network: publish() copies what is due into a bounded outbox.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/dds/participant.h"
#include "common/messages/session.h"
#include "common/record/session_record.h"
#include "sim_server/net/follower.h"
#include "sim_server/net/other_servers.h"
#include "sim_server/net/outbox.h"
#include "sim_server/net/pace.h"
#include "sim_server/session/input_log.h"

namespace sectio {

// All that a standby knows when it takes a session over.
struct Succession {
  std::uint64_t epoch = 0;
  SceneInfo scene = {};  // with the parts that have come off
  std::vector<TriangleMesh> meshes = {};
  std::vector<BodyDelta> last_deltas = {};  // viewers may not have got these
  std::vector<Event> last_events = {};
  std::uint64_t steps = 0;                 // steps that have been run
  std::deque<StepRecord> last_steps = {};  // for another standby, where none are kept on a disk
  InputLog* inputs = nullptr;              // ServerNetOptions::inputs, from now on
  SessionRecord* record = nullptr;         // likewise
};

struct ServerNetOptions {
  NetworkOptions network;
  double state_rate_hz = 60;
  std::uint64_t epoch = 0;                   // 0: a new one (common/messages/epoch.h), or none for a standby
  bool standby = false;                      // listens, and says nothing until take_over()
  SessionRecord* record = nullptr;           // everything that is sent; outlives the net
  InputLog* inputs = nullptr;                // a standby gets the steps from it that it has missed; outlives the net
  std::vector<double> fastest_m_per_s = {};  // by tool; faster poses are followed at this speed; missing: usual
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

  // The tools for which nobody speaks any more, each once a silence. Simulation's thread, after take_samples().
  std::vector<std::uint32_t> take_silent_tools();

  // The tool is in the scene, and nobody may ever speak for it. Simulation's thread.
  void expect(std::uint32_t tool_id);

  // Orders, each once. Simulation's thread; never blocks.
  std::vector<SessionOrder> take_orders();
  std::uint64_t orders_refused() const;  // they came too fast
  // Nobody moves a frozen tool, and its hand feels nothing. Simulation's thread.
  void set_frozen(std::uint32_t tool_id, bool frozen);
  std::uint32_t frozen_tools() const;  // bit t: tool t
  // The pace that the status tells from now on. Simulation's thread.
  void set_pace(const Pace& pace);
  void set_end(double ends_s);  // a record that is played ends there; 0: live

  // A standby becomes the server of its session, or its server begins it anew. Simulation's thread.
  void take_over(Succession succession);
  Follower& follower();
  // Joins the session anew, as after a sleep. Simulation's thread.
  void rejoin(const std::string& why);
  // The number of other servers of the session in the domain, standbys included, whether they have been heard or not.
  std::size_t servers_known() const;

  // How many reports of hands and of viewers a standby has heard. Any thread.
  std::uint64_t hands_heard() const;
  std::uint64_t viewers_heard() const;

  // The simulation is at work. publish() and take_samples() say so, too; a server that says nothing for kHang_s is
  // taken for one that hangs, and followed by its standby. With `for_s`, it is at work for so long. Simulation's
  // thread.
  static constexpr double kHang_s = 2;
  void show_life(double for_s = kHang_s);

  // Simulation's thread; never waits for the network. Deltas, events and contact models always; the state at the
  // state's rate, or at once with publish_now. The step's input goes to a standby.
  void publish(const StepOutput& output, const WorldView& world, double step_wall_time_s,
               std::optional<StepRecord> input = {});

  // All bodies, those included that the next publish() tells of for the first time. Without it, parts look like the
  // body that they came off. Simulation's thread.
  void name_bodies(std::vector<BodyInfo> bodies);

  // Tells of an event that the simulation doesn't make. Simulation's thread.
  void tell(const Event& event);

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
  static constexpr double kServeEnd_s = 10;  // a viewer that slept is met late
  // Serves all of them until the last one has left or the time is over; true for the former. The time begins anew while
  // one pulls a keyframe over a thin link, but not for ever.
  bool wait_for_viewers_to_leave(double timeout_s = kServeEnd_s);

  std::uint64_t epoch() const;
  std::uint64_t writes_refused() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
