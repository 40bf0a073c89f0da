#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/dds/network_arguments.h"
#include "sim_server/commands/mesh_command.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/net/serve.h"
#include "sim_server/net/status.h"
#include "sim_server/net/tilt.h"
#include "sim_server/scene/schema.h"
#include "sim_server/session/run.h"

namespace {

using namespace sectio;

int run_replay(int argc, char** argv) {
  std::string journal, directory;
  Arguments arguments("sim_server replay", "rebuilds the bodies of a session from its journal and says their hashes");
  arguments.option("JOURNAL", journal, "journal of an earlier run", Need::required);
  arguments.option("--export", directory, "directory for the surfaces (OBJ, at rest)");
  if (!arguments.parse(argc, argv)) return 0;
  replay(journal, directory);
  return 0;
}

// One line a tool, for scripts that start a bridge for each: its number, a tab, and the absolute path of its trace.
int list_traces(int argc, char** argv) {
  std::string scene_file;
  Arguments arguments("sim_server traces", "says which trace each tool of a scene follows: NUMBER<tab>FILE");
  arguments.option("SCENE", scene_file, "scene file (YAML)", Need::required);
  if (!arguments.parse(argc, argv)) return 0;
  const Scene scene = load_scene(scene_file, standard_traits());
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const std::string& trace = scene.tools[i].trace_file;
    std::printf("%zu\t%s\n", i, trace.empty() ? "" : std::filesystem::absolute(trace).c_str());
  }
  return 0;
}

// The keys that a scene file may hold.
int print_schema(int argc, char** argv) {
  bool manual = false;
  Arguments arguments("sim_server schema", "prints the JSON Schema of scene files, with which editors complete keys");
  arguments.toggle("--manual", manual, "prints docs/scene.md instead");
  if (!arguments.parse(argc, argv)) return 0;
  std::fputs((manual ? scene_manual(standard_traits()) : scene_schema(standard_traits())).c_str(), stdout);
  return 0;
}

int run_gaps(int argc, char** argv) {
  std::string scene_file;
  Arguments arguments("sim_server gap",
                      "says how far pressing instruments are from the surface that they dent, offline");
  arguments.option("SCENE", scene_file, "scene file (YAML)", Need::required);
  if (!arguments.parse(argc, argv)) return 0;
  std::fputs(measure_gaps(planned(load_scene(scene_file, standard_traits()))).c_str(), stdout);
  return 0;
}

// What model: auto would take, on this machine, and why.
int run_plan(int argc, char** argv) {
  std::string scene_file;
  bool calibrate = false;
  Arguments arguments("sim_server plan", "says which models the bodies of a scene with model: auto get, and why");
  arguments.option("SCENE", scene_file, "scene file (YAML)", Need::required);
  arguments.toggle("--calibrate", calibrate, "measures this machine's speed anew");
  if (!arguments.parse(argc, argv)) return 0;
  const PlannedScene planned = plan_scene(load_scene(scene_file, standard_traits()), calibrate);
  std::fputs(planned.table.empty() ? "no body has model: auto\n" : planned.table.c_str(), stdout);
  if (!planned.table.empty()) std::printf("step: %.3g ms\n", 1e3 * planned.scene.step_s);
  return 0;
}

int run_tilt(int argc, char** argv) {
  NetworkOptions network;
  std::string text;
  double patience_s = 5;
  Arguments arguments("sim_server tilt",
                      "tilts the patient of a running session: gravity turns, at the rate that the scene allows");
  arguments.option("--gravity", text, "where to: x,y,z in m/s2", Need::required);
  add_network_arguments(arguments, network, "session");
  arguments.option("--patience-s", patience_s, "how long to wait for the servers' word");
  if (!arguments.parse(argc, argv)) return 0;
  Vec3 gravity;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &gravity.x(), &gravity.y(), &gravity.z(), &rest) != 3 ||
      !gravity.allFinite())
    throw InputError("--gravity: expected x,y,z in m/s2, got " + text);
  check_network_options(network);
  request_gravity(network, gravity, patience_s);
  return 0;
}

int run_status(int argc, char** argv) {
  NetworkOptions network;
  double patience_s = 5;
  Arguments arguments("sim_server status",
                      "says of each body of a running session what was expected of its model, and what it does");
  add_network_arguments(arguments, network, "session");
  arguments.option("--patience-s", patience_s, "how long to wait for the servers' word");
  if (!arguments.parse(argc, argv)) return 0;
  check_network_options(network);
  std::fputs(status_of_session(network, patience_s).c_str(), stdout);
  return 0;
}

// The names that the bodies of a scene give their servers, one a line, each with its bodies, in the order of these.
int list_servers(int argc, char** argv) {
  std::string scene_file;
  Arguments arguments("sim_server servers", "says among which servers a scene divides its bodies: NAME<tab>BODY,BODY");
  arguments.option("SCENE", scene_file, "scene file (YAML)", Need::required);
  if (!arguments.parse(argc, argv)) return 0;
  std::vector<std::pair<std::string, std::string>> servers;
  for (const BodySpec& body : load_scene(scene_file, standard_traits()).bodies) {
    const auto known = std::ranges::find(servers, body.server, &std::pair<std::string, std::string>::first);
    if (known == servers.end())
      servers.emplace_back(body.server, body.name);
    else
      known->second += "," + body.name;
  }
  for (const auto& [server, bodies] : servers) std::printf("%s\t%s\n", server.c_str(), bodies.c_str());
  return 0;
}

std::vector<std::string> split_at_commas(const std::string& list) {
  std::vector<std::string> names;
  std::istringstream text(list);
  for (std::string name; std::getline(text, name, ',');) names.push_back(name);
  return names;
}

// The share of the scene that the flags give this process.
void take_share(Scene& scene, const std::string& bodies, const std::string& server) {
  if (!bodies.empty() && !server.empty()) throw InputError("--bodies, --server: give one of them, not both");
  if (!bodies.empty()) keep_bodies(scene, split_at_commas(bodies), "--bodies");
  if (server.empty()) return;
  std::vector<std::string> names;
  for (const BodySpec& body : scene.bodies)
    if (body.server == server) names.push_back(body.name);
  keep_bodies(scene, names, "--server " + server);
}

int run_session(int argc, char** argv) {
  std::string scene_file, bodies, server;
  ServeOptions options;
  options.network.session.clear();
  bool offline = false;
  Arguments arguments(
      "sim_server",
      "owns the bodies of a scene and cuts them (also: sim_server replay JOURNAL, traces SCENE, servers SCENE, mesh "
      "SURFACE, gap SCENE, plan SCENE, tilt, status)");
  arguments.option("--scene", scene_file, "scene file (YAML)", Need::required);
  arguments.option("--bodies", bodies,
                   "names, with commas: only these bodies; other servers of the session have the rest");
  arguments.option("--server", server, "only the bodies for which the scene says `server:` with this name");
  arguments.option("--steps", options.steps, "steps to simulate; 0: the scene's duration");
  arguments.option("--export", options.directory, "directory for surfaces (OBJ), journal and report.json");
  arguments.toggle("--offline", offline, "no network: the scene's own traces, as fast as it goes");
  arguments.toggle("--endless", options.endless, "until it is stopped");
  add_network_arguments(arguments, options.network, "name of the session; empty: the scene's");
  arguments.option("--wait-for-viewers", options.wait_for_viewers, "the clock starts when so many are there");
  arguments.toggle("--wait-for-tools", options.wait_for_tools, "the clock starts when every tool has been heard of");
  arguments.toggle("--wait-for-bodies", options.wait_for_bodies,
                   "the clock starts when every body of the scene has a server");
  arguments.toggle("--play-traces", options.play_traces,
                   "instruments follow the scene's own traces step by step; bridges are not heard");
  arguments.option("--stall-at-s", options.stall_at_s, "for tests: simulated time at which the simulation stops once");
  arguments.option("--stall-s", options.stall_s, "for tests: how long it stops");
  if (!arguments.parse(argc, argv)) return 0;

  Scene scene = planned(load_scene(scene_file, standard_traits()));
  take_share(scene, bodies, server);
  if (!options.network.session.empty()) scene.session = options.network.session;
  options.network.session = scene.session;
  const std::string report = offline ? run_offline(scene, options.steps, options.directory) : serve(scene, options);
  std::fputs(report.c_str(), stdout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  return run_program("sim_server", [&] {
    if (first == "replay") return run_replay(argc - 1, argv + 1);
    if (first == "mesh") return run_mesh_command(argc - 1, argv + 1);
    if (first == "tilt") return run_tilt(argc - 1, argv + 1);
    if (first == "status") return run_status(argc - 1, argv + 1);
    if (first == "plan") return run_plan(argc - 1, argv + 1);
    if (first == "schema") return print_schema(argc - 1, argv + 1);
    if (first == "gap") return run_gaps(argc - 1, argv + 1);
    if (first == "traces") return list_traces(argc - 1, argv + 1);
    if (first == "servers") return list_servers(argc - 1, argv + 1);
    return run_session(argc, argv);
  });
}
