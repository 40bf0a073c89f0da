#include <cstdio>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "sim_server/run.h"

int main(int argc, char** argv) {
  return sectio::run_program("sim_server", [&] {
    std::string scene_file, export_directory;
    bool offline = false;
    std::uint64_t steps = 0;
    sectio::Arguments arguments("sim_server", "owns the bodies of a scene and cuts them");
    arguments.option("--scene", scene_file, "scene file (YAML)", sectio::Need::required);
    arguments.toggle("--offline", offline, "no network: the scene's own traces, as fast as it goes");
    arguments.option("--steps", steps, "steps to simulate; 0: the scene's duration");
    arguments.option("--export", export_directory, "directory for surfaces (OBJ), journal and report.json");
    if (!arguments.parse(argc, argv)) return 0;
    const sectio::Scene scene = sectio::load_scene(scene_file);
    std::fputs(sectio::run_offline(scene, {steps, export_directory}).c_str(), stdout);
    return 0;
  });
}
