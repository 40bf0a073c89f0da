#include <cstdio>
#include <filesystem>

#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// One line a tool, for scripts that start a bridge for each: its number, a tab, and the absolute path of its trace.
Arguments::Action traces_command(Arguments& arguments) {
  const auto file = std::make_shared<std::string>();
  arguments.option("SCENE", *file, "scene file (YAML)", Need::required);
  return [file] {
    const Scene scene = load_scene(*file, standard_traits());
    for (std::size_t i = 0; i < scene.tools.size(); ++i) {
      const std::string& trace = scene.tools[i].trace_file;
      std::printf("%zu\t%s\n", i, trace.empty() ? "" : std::filesystem::absolute(trace).c_str());
    }
    return 0;
  };
}

}  // namespace sectio
