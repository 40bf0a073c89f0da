#include <cstdio>
#include <filesystem>
#include <string_view>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/dds/network_arguments.h"
#include "sim_server/net/serve.h"
#include "sim_server/run.h"

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
  const Scene scene = load_scene(scene_file);
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const std::string& trace = scene.tools[i].trace_file;
    std::printf("%zu\t%s\n", i, trace.empty() ? "" : std::filesystem::absolute(trace).c_str());
  }
  return 0;
}

int run_session(int argc, char** argv) {
  std::string scene_file;
  ServeOptions options;
  options.network.session.clear();
  bool offline = false;
  Arguments arguments(
      "sim_server",
      "owns the bodies of a scene and cuts them (also: sim_server replay JOURNAL, sim_server traces SCENE)");
  arguments.option("--scene", scene_file, "scene file (YAML)", Need::required);
  arguments.option("--steps", options.steps, "steps to simulate; 0: the scene's duration");
  arguments.option("--export", options.directory, "directory for surfaces (OBJ), journal and report.json");
  arguments.toggle("--offline", offline, "no network: the scene's own traces, as fast as it goes");
  arguments.toggle("--endless", options.endless, "until it is stopped");
  add_network_arguments(arguments, options.network, "name of the session; empty: the scene's");
  arguments.option("--wait-for-viewers", options.wait_for_viewers, "the clock starts when so many are there");
  arguments.toggle("--wait-for-tools", options.wait_for_tools, "the clock starts when every tool has been heard of");
  arguments.option("--stall-at-s", options.stall_at_s, "for tests: simulated time at which the simulation stops once");
  arguments.option("--stall-s", options.stall_s, "for tests: how long it stops");
  if (!arguments.parse(argc, argv)) return 0;

  Scene scene = load_scene(scene_file);
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
    if (first == "traces") return list_traces(argc - 1, argv + 1);
    return run_session(argc, argv);
  });
}
