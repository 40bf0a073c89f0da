#include "sim_server/net/serve.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <set>
#include <thread>

#include "common/core/log.h"
#include "sim_server/net/world_view.h"
#include "sim_server/run.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kGiveUpS = 0.25;     // this far behind, the clock is set back: the session runs slower, not in bursts
constexpr double kLeaveTimeoutS = 5;  // how long the end is served to viewers
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

// Until viewers and tools are there; samples that come meanwhile are kept.
void wait_for_peers(ServerNet& net, const Scene& scene, const ServeOptions& options, std::vector<ToolSample>& samples) {
  std::set<std::uint32_t> tools;
  const auto complete = [&] {
    return net.viewers() >= options.wait_for_viewers && (!options.wait_for_tools || tools.size() >= scene.tools.size());
  };
  if (!complete()) log_info("waiting for viewers and tools");
  while (!stop_requested && !complete()) {
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
