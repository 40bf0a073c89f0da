#include <cstdio>

#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/choose_model.h"

namespace sectio {

Arguments::Action plan_command(Arguments& arguments) {
  struct Flags {
    std::string scene;
    bool calibrate = false;
  };
  const auto flags = std::make_shared<Flags>();
  arguments.option("SCENE", flags->scene, "scene file (YAML)", Need::required);
  arguments.toggle("--calibrate", flags->calibrate, "measures this machine's speed anew");
  return [flags] {
    const PlannedScene planned =
        plan_scene(load_scene(flags->scene, standard_traits()), standard_engines(), flags->calibrate);
    std::fputs(planned.table.empty() ? "no body has model: auto\n" : planned.table.c_str(), stdout);
    if (!planned.table.empty()) std::printf("step: %.3g ms\n", 1e3 * planned.scene.step_s);
    return 0;
  };
}

}  // namespace sectio
