// Runs a command as its program would, with these words behind its name.
#pragma once

#include <string>
#include <vector>

#include "sim_server/commands/commands.h"

namespace sectio::commands_test {

inline int run_command(const std::string& name, Arguments::Action (*command)(Arguments&),
                       std::vector<std::string> words) {
  words.insert(words.begin(), name);
  Arguments arguments(name, "");
  const Arguments::Action action = command(arguments);
  std::vector<const char*> argv;
  for (const std::string& word : words) argv.push_back(word.c_str());
  return arguments.run(static_cast<int>(argv.size()), argv.data(), action);
}

}  // namespace sectio::commands_test
