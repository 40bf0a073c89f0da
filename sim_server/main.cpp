#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/dds/network_arguments.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/net/serve.h"
#include "sim_server/run.h"
#include "sim_server/scene/mesh_import.h"

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

// A surface, or tetrahedra from another program, to tetrahedra with a report on them.
int make_tetrahedra(int argc, char** argv) {
  std::string in, out, unit = "m", mesher = "lattice";
  FillSettings settings;
  Arguments arguments("sim_server mesh", "fills a closed surface with tetrahedra and says how good they are");
  arguments.option("IN", in, "surface (OBJ, STL, PLY, glTF) or tetrahedra (.msh, .vtk, .node)", Need::required);
  arguments.option("--tets", out, "file for the tetrahedra, in metres: .msh, .vtk or .node (with .ele)");
  arguments.choice("--unit", unit, {"m", "cm", "mm"}, "length of IN's unit");
  arguments.choice("--mesher", mesher, {"lattice", "tetgen", "best"}, "best: the one with the larger stable step");
  arguments.option("--tetrahedra", settings.tetrahedra, "about so many");
  arguments.option("--young-pa", settings.material.young_pa, "for the stable step");
  arguments.option("--poisson", settings.material.poisson, "for the stable step");
  arguments.option("--density-kg-per-m3", settings.material.density_kg_per_m3, "for the stable step");
  if (!arguments.parse(argc, argv)) return 0;
  const ElasticConstants& m = settings.material;
  if (!(settings.tetrahedra >= 12)) throw InputError("--tetrahedra: expected at least 12");
  if (!(m.young_pa > 0)) throw InputError("--young-pa: expected > 0");
  if (!(m.poisson >= 0 && m.poisson < 0.5)) throw InputError("--poisson: expected at least 0 and below 0.5");
  if (!(m.density_kg_per_m3 > 0)) throw InputError("--density-kg-per-m3: expected > 0");
  settings.mesher = mesher == "lattice" ? Mesher::lattice : mesher == "tetgen" ? Mesher::tetgen : Mesher::best;
  const double unit_m = unit == "m" ? 1 : unit == "cm" ? 0.01 : 0.001;

  FilledVolume filled;
  if (is_tet_file(in)) {
    TetFile file = read_tet_file(in, unit_m);
    filled.mesh = std::move(file.mesh);
    filled.notes = std::move(file.notes);
    filled.report = report_on(filled.mesh, "file", check(filled.mesh).volume_m3, m);
    filled.compared = {filled.report};
  } else {
    const ImportedMesh surface = import_mesh(in, unit_m);
    try {
      filled = fill(surface.soup, settings);
    } catch (const InputError& error) {
      throw InputError(in + ": " + error.what());
    }
    filled.notes.insert(filled.notes.begin(), surface.mended.begin(), surface.mended.end());
  }
  for (const std::string& note : filled.notes) std::printf("note: %s\n", note.c_str());
  for (const FillReport& report : filled.compared) std::printf("%s\n", to_string(report).c_str());
  if (filled.compared.size() > 1) std::printf("kept: %s\n", filled.report.mesher.c_str());
  if (!out.empty()) write_tet_file(out, filled.mesh);
  return 0;
}

int run_gaps(int argc, char** argv) {
  std::string scene_file;
  Arguments arguments("sim_server gap",
                      "says how far pressing instruments are from the surface that they dent, offline");
  arguments.option("SCENE", scene_file, "scene file (YAML)", Need::required);
  if (!arguments.parse(argc, argv)) return 0;
  std::fputs(measure_gaps(load_scene(scene_file)).c_str(), stdout);
  return 0;
}

// The names that the bodies of a scene give their servers, one a line, each with its bodies, in the order of these.
int list_servers(int argc, char** argv) {
  std::string scene_file;
  Arguments arguments("sim_server servers", "says among which servers a scene divides its bodies: NAME<tab>BODY,BODY");
  arguments.option("SCENE", scene_file, "scene file (YAML)", Need::required);
  if (!arguments.parse(argc, argv)) return 0;
  std::vector<std::pair<std::string, std::string>> servers;
  for (const BodySpec& body : load_scene(scene_file).bodies) {
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
      "SURFACE, gap SCENE)");
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

  Scene scene = load_scene(scene_file);
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
    if (first == "mesh") return make_tetrahedra(argc - 1, argv + 1);
    if (first == "gap") return run_gaps(argc - 1, argv + 1);
    if (first == "traces") return list_traces(argc - 1, argv + 1);
    if (first == "servers") return list_servers(argc - 1, argv + 1);
    return run_session(argc, argv);
  });
}
