// The command line, the same way in every program: --help with units and defaults, --version, --log-level, commands,
// and exit code 2 with one clear line for a flag that can't be used.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace sectio {

enum class Need { optional, required };

class Arguments {
 public:
  using Action = std::function<int()>;  // returns the exit code

  Arguments(const std::string& program, const std::string& purpose);
  ~Arguments();

  // `flag` is "--duration-s" (its name ends with the unit), or "FILE" for an argument without a flag. `value` holds the
  // default, which the help shows, and must outlive parse(). T: std::string, double (finite), int, std::uint32_t,
  // std::uint64_t, std::vector<std::string> (the flag may be repeated).
  template <class T>
  void option(const std::string& flag, T& value, const std::string& meaning, Need need = Need::optional);

  void choice(const std::string& flag, std::string& value, const std::vector<std::string>& allowed,
              const std::string& meaning);

  // True when given.
  void toggle(const std::string& flag, bool& value, const std::string& meaning);

  // `PROGRAM NAME ...`: declare() adds the command's own flags and returns what the command does.
  void command(const std::string& name, const std::string& purpose, const std::function<Action(Arguments&)>& declare);

  // False when --help or --version has printed all there is to say. Throws InputError that names the flag; one that
  // nobody knows is named before one that is missing.
  [[nodiscard]] bool parse(int argc, const char* const* argv);

  // Parses, and runs the command that the line names, or else this action.
  int run(int argc, const char* const* argv, const Action& without_command);

 private:
  struct Parser;
  explicit Arguments(std::unique_ptr<Parser> parser);

  std::unique_ptr<Parser> parser_;
};

// The body of every main(): names the log, runs `body` and returns its exit code; prints an InputError as one line and
// returns kExitBadInput; any other exception returns 1. A limit on the size of files (ulimit -f) is like a full disk,
// for programs that this one starts, too: a write fails, and SIGXFSZ ends nothing.
int run_program(const std::string& program, const std::function<int()>& body);

}  // namespace sectio
