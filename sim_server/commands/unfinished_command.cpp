#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "sim_server/commands/commands.h"
#include "sim_server/session/run_files.h"

namespace sectio {

// One line, for scripts that resume a session, or nothing: the last step, a tab, and the directory.
Arguments::Action unfinished_command(Arguments& arguments) {
  const auto directories = std::make_shared<std::vector<std::string>>();
  arguments.option("DIRECTORY", *directories, "directories of earlier --exports, the newest first", Need::required);
  return [directories] {
    for (const std::string& directory : *directories)
      if (!std::filesystem::is_directory(directory)) throw InputError(directory + ": no such directory");
    if (const std::optional<Furthest> furthest = furthest_unfinished(*directories))
      std::printf("%llu\t%s\n", static_cast<unsigned long long>(furthest->step), furthest->directory.c_str());
    return 0;
  };
}

}  // namespace sectio
