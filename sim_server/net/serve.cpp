#include "sim_server/net/serve.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <set>
#include <thread>

#include "common/core/error.h"
#include "common/core/log.h"
#include "sim_server/net/world_view.h"
#include "sim_server/run.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kGiveUpS = 0.25;     // this far behind, the clock is set back: the session runs slower, not in bursts
constexpr double kLeaveTimeoutS = 5;  // how long the end is served to viewers
constexpr double kListen_s = 0.3;     // before the clock starts: is there another server with our bodies?
constexpr auto kPollPeriod = std::chrono::milliseconds(2);

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) {
  stop_requested = 1;
}

Clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
}

std::vector<TriangleMesh> meshes_of(const Simulation& simulation) {
  std::vector<TriangleMesh> meshes;
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i) meshes.push_back(simulation.mesh(i));
  return meshes;
}

void yield_to_an_older_server(const ServerNet& net, const ServeOptions& options) {
  if (const auto body = net.claimed_body())
    throw InputError("session '" + options.network.session + "': another server has the body '" + *body + "'");
}

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// Until viewers, tools and the other servers are there.
void wait_for_peers(ServerNet& net, const Scene& scene, const ServeOptions& options, std::vector<ToolSample>& samples) {
  std::set<std::uint32_t> tools;
  const auto listen_until = Clock::now() + to_duration(kListen_s);
  const auto complete = [&] {
    return net.viewers() >= options.wait_for_viewers &&
           (!options.wait_for_tools || tools.size() >= scene.tools.size()) &&
           (!options.wait_for_bodies || net.missing_bodies().empty());
  };
  if (!complete()) log_info("waiting for viewers and tools");
  if (options.wait_for_bodies && !net.missing_bodies().empty())
    log_info("waiting for servers of " + list_of(net.missing_bodies()));
  while (!stop_requested && (!complete() || Clock::now() < listen_until)) {
    yield_to_an_older_server(net, options);
    samples.clear();  // what the tools do before the clock starts is not part of the session
    net.take_samples(samples);
    for (const ToolSample& s : samples) tools.insert(s.tool_id);
    std::this_thread::sleep_for(kPollPeriod);
  }
}

}  // namespace

std::string serve(const Scene& scene, const ServeOptions& options) {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  Simulation simulation(scene);
  RunRecord record(scene, simulation, options.directory);
  ServerNetOptions net_options;
  net_options.network = options.network;
  ServerNet net(net_options, scene_info(scene), meshes_of(simulation));
  log_info("session '" + options.network.session + "' on domain " + std::to_string(options.network.domain));

  StepInput input;
  wait_for_peers(net, scene, options, input.samples);
  log_info("the session begins");
  const std::uint64_t steps = options.endless ? UINT64_MAX : steps_of(scene, options.steps);
  Progress progress(steps);
  WorldView world;
  double stall_s = options.stall_at_s >= 0 ? options.stall_s : 0;
  auto due = Clock::now();
  for (std::uint64_t k = 1; k <= steps && !stop_requested; ++k) {
    yield_to_an_older_server(net, options);
    if (options.play_traces)
      input.samples = samples_of_traces(scene, k);
    else
      net.take_samples(input.samples);
    const auto start = Clock::now();
    const StepOutput& output = simulation.step(input);
    if (stall_s > 0 && output.sim_time_s >= options.stall_at_s) {
      std::this_thread::sleep_for(Seconds(stall_s));
      stall_s = 0;
    }
    const double step_wall_time_s = Seconds(Clock::now() - start).count();
    record.add(output, step_wall_time_s);
    view_world(simulation, scene.tools.size(), world);
    net.publish(output, world, step_wall_time_s);
    progress.show(output);
    input.samples.clear();

    due += to_duration(scene.step_s);
    if (Clock::now() - due > to_duration(kGiveUpS)) {
      log_limited(LogLevel::warning, "overrun",
                  "steps take longer than their time; the session runs slower than real time");
      due = Clock::now();
    }
    std::this_thread::sleep_until(due);
  }
  net.end_session(stop_requested ? "stopped" : "complete");
  net.wait_for_viewers_to_leave(kLeaveTimeoutS);
  return record.finish(simulation);
}

}  // namespace sectio
