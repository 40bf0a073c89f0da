#include <cstdio>

#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/gap.h"

namespace sectio {

Arguments::Action gap_command(Arguments& arguments) {
  const auto scene = std::make_shared<std::string>();
  arguments.option("SCENE", *scene, "scene file (YAML)", Need::required);
  return [scene] {
    std::fputs(measure_gaps(prepared(load_scene(*scene, standard_traits()))).c_str(), stdout);
    return 0;
  };
}

}  // namespace sectio
