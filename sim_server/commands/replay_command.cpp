#include <cstdio>

#include "sim_server/commands/commands.h"
#include "sim_server/session/replay.h"

namespace sectio {

Arguments::Action replay_command(Arguments& arguments) {
  struct Flags {
    std::string journal, directory;
  };
  const auto flags = std::make_shared<Flags>();
  arguments.option("JOURNAL", flags->journal, "journal of an earlier run", Need::required);
  arguments.option("--export", flags->directory, "directory for the surfaces (OBJ, at rest)");
  return [flags] {
    std::fputs(replay(flags->journal, flags->directory).c_str(), stdout);
    return 0;
  };
}

}  // namespace sectio
