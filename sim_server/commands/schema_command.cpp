#include <cstdio>

#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/scene/schema.h"
#include "sim_server/scene/tissues.h"

namespace sectio {

Arguments::Action schema_command(Arguments& arguments) {
  struct Flags {
    bool manual = false, tissues = false;
  };
  const auto flags = std::make_shared<Flags>();
  arguments.toggle("--manual", flags->manual, "prints docs/scene.md instead");
  arguments.toggle("--tissues", flags->tissues, "prints the table of tissues of docs/tissue.md instead");
  return [flags] {
    const std::string text = flags->tissues  ? tissue_manual()
                             : flags->manual ? scene_manual(standard_traits())
                                             : scene_schema(standard_traits());
    std::fputs(text.c_str(), stdout);
    return 0;
  };
}

}  // namespace sectio
