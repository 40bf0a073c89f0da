#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "common/core/error.h"
#include "sim_server/commands/commands.h"
#include "sim_server/session/run_files.h"

namespace sectio {

// One line a session, for scripts that resume one: its last step, a tab, and its directory. The furthest comes first;
// sessions that are as far are in the order in which they were named.
Arguments::Action unfinished_command(Arguments& arguments) {
  const auto directories = std::make_shared<std::vector<std::string>>();
  arguments.option("DIRECTORY", *directories, "directories of an earlier --export, each", Need::required);
  return [directories] {
    std::vector<std::pair<std::uint64_t, std::string>> sessions;
    for (const std::string& directory : *directories) {
      if (!std::filesystem::is_directory(directory)) throw InputError(directory + ": no such directory");
      if (const auto step = last_unfinished_step(directory)) sessions.emplace_back(*step, directory);
    }
    std::ranges::stable_sort(sessions, std::greater(), &std::pair<std::uint64_t, std::string>::first);
    for (const auto& [step, directory] : sessions)
      std::printf("%llu\t%s\n", static_cast<unsigned long long>(step), directory.c_str());
    return 0;
  };
}

}  // namespace sectio
