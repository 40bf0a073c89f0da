#include "sim_server/net/serve.h"
#include "sim_server/prepare/fill_volumes.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <set>
#include <thread>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/processor_time.h"
#include "sim_server/net/budget.h"
#include "sim_server/net/world_view.h"
#include "sim_server/scene/scene_warnings.h"
#include "sim_server/session/progress.h"
#include "sim_server/session/recorder.h"
#include "sim_server/session/trace_player.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kTogether_s = 0.1;    // the most by which a server may be ahead of the slowest one of its session
constexpr double kLeaveTimeout_s = 5;  // how long the end is served to viewers
constexpr double kListen_s = 0.3;      // before the clock starts: is there another server with our bodies?
constexpr auto kStartPollPeriod = std::chrono::milliseconds(2);

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
  if (const auto body = net.others().claimed_body())
    throw InputError("session '" + options.network.session + "': another server has the body '" + *body + "'");
}

// Waits for servers that are too far behind this one. Returns the seconds that it took.
double wait_for_the_slowest(const ServerNet& net, double sim_time_s) {
  const auto begun = Clock::now();
  const auto too_far = [&] {
    const std::optional<double> slowest_s = net.others().slowest_s();
    return slowest_s && sim_time_s > *slowest_s + kTogether_s;
  };
  if (!too_far()) return 0;
  while (!stop_requested && too_far()) std::this_thread::sleep_for(kStartPollPeriod);
  return Seconds(Clock::now() - begun).count();
}

// The reaction to a session that is behind its clock goes into the next step and, when it changes, into the log.
void answer_lag(BudgetPlanner& planner, double behind_s, StepInput& input) {
  const Budget budget = planner.plan(behind_s);
  input.spare_idle_bodies = budget == Budget::reduced;
  input.overrun.clear();
  if (budget == Budget::kept && !planner.changed()) return;
  char text[96];
  std::snprintf(text, sizeof text, "%s: %.0f ms behind", to_string(budget), 1e3 * std::max(0.0, behind_s));
  if (planner.changed()) input.overrun = text;
  log_limited(LogLevel::warning, to_string(budget), text);
}

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// Waits for viewers, tools and other servers.
void wait_for_peers(ServerNet& net, const Scene& scene, const ServeOptions& options, std::vector<ToolSample>& samples) {
  std::set<std::uint32_t> tools;
  const auto listen_until = Clock::now() + to_duration(kListen_s);
  const auto complete = [&] {
    return net.viewers() >= options.wait_for_viewers &&
           (!options.wait_for_tools || tools.size() >= scene.tools.size()) &&
           (!options.wait_for_bodies || net.others().missing_bodies().empty());
  };
  if (!complete()) log_info("waiting for viewers and tools");
  if (options.wait_for_bodies && !net.others().missing_bodies().empty())
    log_info("waiting for servers of " + list_of(net.others().missing_bodies()));
  while (!stop_requested && (!complete() || Clock::now() < listen_until)) {
    yield_to_an_older_server(net, options);
    samples.clear();  // motion before the clock starts is not part of the session
    net.take_samples(samples);
    for (const ToolSample& s : samples) tools.insert(s.tool_id);
    std::this_thread::sleep_for(kStartPollPeriod);
  }
}

}  // namespace

RunResult serve(const Scene& scene, const ServeOptions& options) {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  const Scene filled = fill_volumes(scene);
  Simulation simulation(filled);
  simulation.measure_with(processor_time_s);
  Recorder record(filled, simulation, options.directory);
  const std::optional<std::uint64_t> steps =
      options.endless ? std::nullopt : std::optional(steps_of(scene, options.steps));
  const double duration_s = steps ? std::max(scene.duration_s, static_cast<double>(*steps) * scene.step_s) : HUGE_VAL;
  for (const std::string& text : scene_warnings(filled, duration_s)) record.warn(text);
  ServerNetOptions net_options;
  net_options.network = options.network;
  ServerNet net(net_options, scene_info(scene), meshes_of(simulation));
  log_info("session '" + options.network.session + "' on domain " + std::to_string(options.network.domain));

  StepInput input;
  wait_for_peers(net, scene, options, input.samples);
  log_info("the session begins");
  Progress progress(steps);
  WorldView world;
  double stall_s = options.stall_at_s >= 0 ? options.stall_s : 0;
  BudgetPlanner planner(!options.play_traces);
  SyncCost cost;
  auto due = Clock::now();
  for (std::uint64_t k = 1; (!steps || k <= *steps) && !stop_requested; ++k) {
    yield_to_an_older_server(net, options);
    if (const double waited_s = wait_for_the_slowest(net, static_cast<double>(k) * scene.step_s); waited_s > 0) {
      cost.waited_for_servers_s += waited_s;
      due = Clock::now();
    }
    answer_lag(planner, Seconds(Clock::now() - due).count(), input);
    if (options.play_traces)
      input.samples = samples_of_traces(scene, k);
    else
      net.take_samples(input.samples);
    input.gravity_m_per_s2 = net.take_gravity();
    const auto start = Clock::now();
    const StepOutput& output = simulation.step(input);
    if (stall_s > 0 && output.sim_time_s >= options.stall_at_s) {
      std::this_thread::sleep_for(Seconds(stall_s));
      stall_s = 0;
    }
    const double step_wall_time_s = Seconds(Clock::now() - start).count();
    record.add(output, step_wall_time_s);
    view_world(simulation, scene.tools.size(), world);
    const auto published = Clock::now();
    net.publish(output, world, step_wall_time_s);
    record.add_publish(Seconds(Clock::now() - published).count());
    progress.show(output);
    input.samples.clear();

    if (planner.now() == Budget::slowed) due = start;  // the session runs slower, not in bursts
    due += to_duration(scene.step_s);
    std::this_thread::sleep_until(due);
  }
  net.end_session(stop_requested ? "stopped" : "complete");
  if (const std::uint32_t lost = net.lost_viewers(); lost > 0)
    log_info("waiting for viewers that went silent: " + std::to_string(lost));
  net.wait_for_viewers_to_leave(kLeaveTimeout_s);
  cost.copy_bytes = net.copy_bytes();
  cost.network_total_s = net.busy_s();
  cost.deferred_steps = planner.steps(Budget::deferred);
  cost.reduced_steps = planner.steps(Budget::reduced);
  cost.slowed_steps = planner.steps(Budget::slowed);
  cost.most_behind_s = planner.most_behind_s();
  record.set(cost);
  return record.finish();
}

}  // namespace sectio
