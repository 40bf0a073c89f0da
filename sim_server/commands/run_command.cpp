#include <cstdio>
#include <filesystem>
#include <sstream>
#include <system_error>

#include "common/core/error.h"
#include "common/dds/network_arguments.h"
#include "sim_server/commands/commands.h"
#include "sim_server/commands/recorded_scene.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/net/serve.h"
#include "sim_server/prepare/choose_model.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/input_log.h"
#include "sim_server/session/offline_run.h"
#include "sim_server/session/run_files.h"

namespace sectio {
namespace {

struct RunFlags {
  std::string scene, bodies, server, resume;
  ServeOptions options;
  bool offline = false;
};

std::vector<std::string> split_at_commas(const std::string& list) {
  std::vector<std::string> names;
  std::istringstream text(list);
  for (std::string name; std::getline(text, name, ',');) names.push_back(name);
  return names;
}

// Leaves the share of the scene that the flags give this process.
void take_share(Scene& scene, const RunFlags& flags) {
  if (!flags.bodies.empty() && !flags.server.empty())
    throw InputError("--bodies, --server: give one of them, not both");
  if (!flags.bodies.empty()) keep_bodies(scene, split_at_commas(flags.bodies), "--bodies");
  if (flags.server.empty()) return;
  std::vector<std::string> names;
  for (const BodySpec& body : scene.bodies)
    if (body.server == flags.server) names.push_back(body.name);
  keep_bodies(scene, names, "--server " + flags.server);
}

// `past`: the directory of the try that goes on.
Scene scene_to_run(const RunFlags& flags, const std::string& past) {
  if (flags.resume.empty()) {
    if (flags.scene.empty()) throw InputError("--scene: required, or --resume");
    Scene scene = planned(load_scene(flags.scene, standard_traits()), standard_engines());
    take_share(scene, flags);  // a share of the whole plan: the servers of a session have one step
    return prepared(std::move(scene));
  }
  for (const auto& [flag, given] : {std::pair("--scene", !flags.scene.empty()),
                                    {"--offline", flags.offline},
                                    {"--export", !flags.options.directory.empty() && flags.options.until_s < 0 &&
                                                     !flags.options.standby && !is_mcap(flags.resume)}})
    if (given) throw InputError(std::string(flag) + ": --resume goes on with what the directory says");
  Scene scene = recorded_scene(input_log_path(past));
  const std::size_t count = scene.bodies.size();
  take_share(scene, flags);
  if (scene.bodies.size() != count)
    throw InputError(past + ": a session of other bodies than --server or --bodies names");
  return scene;
}

bool is_same_file(const std::string& one, const std::string& other) {
  std::error_code error;
  return std::filesystem::equivalent(one, other, error);
}

int run_session(const RunFlags& flags) {
  if (flags.options.until_s < 0 && flags.options.until_s != ServeOptions().until_s)
    throw InputError("--until-s: expected >= 0, got " + std::to_string(flags.options.until_s));
  const int attempt = newest_try(flags.resume);
  ServeOptions options = flags.options;
  options.resume = try_directory(flags.resume, attempt);
  Scene scene = scene_to_run(flags, options.resume);
  if (options.standby && !flags.resume.empty() &&
      (options.directory.empty() || is_same_file(flags.resume, options.directory)))
    throw InputError("--standby --resume: needs --export, a directory of its own");
  if (options.until_s >= 0 && (flags.resume.empty() || options.directory.empty()))
    throw InputError("--until-s: needs --resume, and --export for the session that branches off there");
  if (options.until_s >= 0 && is_same_file(flags.resume, options.directory))
    throw InputError("--until-s: needs another --export than " + flags.resume + ", which keeps what it has");
  if (is_same_file(flags.resume, options.record))
    throw InputError("--record: needs another file than " + flags.resume + ", which keeps what it has");
  if (!flags.resume.empty() && options.directory.empty()) {
    if (is_mcap(flags.resume)) throw InputError("--resume: a record needs --export, for the session that goes on");
    options.directory = flags.resume;
    options.attempt = attempt;
  }
  if (!options.record.empty() && flags.offline)
    throw InputError("--record: it is of a session on the network: --play-traces instead of --offline");
  if (flags.offline)
    for (const auto& [flag, given] : {std::pair("--endless", options.endless),
                                      {"--peer", !options.network.peers.empty()},
                                      {"--interface", !options.network.interfaces.empty()},
                                      {"--wait-for-viewers", options.wait_for_viewers > 0},
                                      {"--wait-for-tools", options.wait_for_tools},
                                      {"--wait-for-bodies", options.wait_for_bodies}})
      if (given) throw InputError(std::string(flag) + ": it is of a session on the network, without --offline");
  if (options.endless && options.steps > 0) throw InputError("--endless, --steps: give one of them, not both");
  if (options.standby && flags.offline)
    throw InputError("--standby: it takes part in a session on the network, without --offline");
  if (!(options.fastest_m_per_s >= 0 && options.fastest_m_per_s <= 100))
    throw InputError("--max-speed-m-per-s: expected 0 to 100, got " + std::to_string(options.fastest_m_per_s));
  if (!options.network.session.empty()) scene.session = options.network.session;
  options.network.session = scene.session;
  const RunResult result = flags.offline ? run_offline(scene, options.steps, options.directory) : serve(scene, options);
  std::fputs(result.report.c_str(), stdout);
  return result.exit_code();
}

}  // namespace

Arguments::Action run_command(Arguments& arguments) {
  const auto flags = std::make_shared<RunFlags>();
  ServeOptions& options = flags->options;
  options.network.session.clear();
  arguments.option("--scene", flags->scene, "scene file (YAML)");
  arguments.option("--resume", flags->resume,
                   "directory of an earlier --export, or a server's --record: the session goes on after the last step "
                   "that it holds; with --standby that of the server, so that a late standby begins there");
  arguments.option("--until-s", options.until_s,
                   "with --resume: goes on from this simulated time, in the directory of --export");
  arguments.option("--bodies", flags->bodies,
                   "names, with commas: only these bodies; other servers of the session have the rest");
  arguments.option("--server", flags->server, "only the bodies for which the scene says `server:` with this name");
  arguments.option("--steps", options.steps, "steps to simulate; 0: the scene's duration");
  arguments.option("--export", options.directory, "directory for surfaces (OBJ), journals and report.json");
  arguments.option("--record", options.record,
                   "MCAP file for everything that is sent, and the inputs: see replay and play");
  arguments.toggle("--offline", flags->offline, "no network: the scene's own traces, as fast as it goes");
  arguments.toggle("--standby", options.standby,
                   "takes part in the steps of another server of the session, and follows it when it dies");
  arguments.toggle("--endless", options.endless, "until it is stopped");
  add_network_arguments(arguments, options.network, "name of the session; empty: the scene's");
  arguments.option("--wait-for-viewers", options.wait_for_viewers, "the clock starts when so many are there");
  arguments.option("--max-speed-m-per-s", options.fastest_m_per_s,
                   "instruments that are moved faster are followed at this speed; 0: as the scene says");
  arguments.toggle("--wait-for-tools", options.wait_for_tools, "the clock starts when every tool has been heard of");
  arguments.toggle("--wait-for-bodies", options.wait_for_bodies,
                   "the clock starts when every body of the scene has a server");
  arguments.toggle("--play-traces", options.play_traces,
                   "instruments follow the scene's own traces step by step; bridges are not heard");
  arguments.option("--stall-at-s", options.stall_at_s, "for tests: simulated time at which the simulation stops once");
  arguments.option("--stall-s", options.stall_s, "for tests: how long it stops");
  return [flags] { return run_session(*flags); };
}

}  // namespace sectio
