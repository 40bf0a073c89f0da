#include <cstdio>

#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/scene/schema.h"

namespace sectio {

Arguments::Action schema_command(Arguments& arguments) {
  const auto manual = std::make_shared<bool>(false);
  arguments.toggle("--manual", *manual, "prints docs/scene.md instead");
  return [manual] {
    std::fputs((*manual ? scene_manual(standard_traits()) : scene_schema(standard_traits())).c_str(), stdout);
    return 0;
  };
}

}  // namespace sectio
