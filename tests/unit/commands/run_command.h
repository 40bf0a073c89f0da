// Runs a command as its program would, with these words behind its name.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/core/error.h"
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

// The line with which it refuses these words; empty: it doesn't.
inline std::string refusal_of(const std::string& name, Arguments::Action (*command)(Arguments&),
                              std::vector<std::string> words) {
  try {
    run_command(name, command, std::move(words));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace sectio::commands_test
