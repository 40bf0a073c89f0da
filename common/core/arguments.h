// The command line, the same way in every program: --help with units and defaults, --version, and exit code 2 with one
// clear line for a flag that can't be used.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace sectio {

enum class Need { optional, required };

class Arguments {
 public:
  Arguments(const std::string& program, const std::string& purpose);
  ~Arguments();

  // `flag` is "--duration-s" (its name ends with the unit), or "FILE" for an argument without a flag. `value` holds the
  // default, which the help shows, and must outlive parse(). T: std::string, double (finite), int, std::uint32_t,
  // std::uint64_t, std::vector<std::string> (the flag may be repeated).
  template <class T>
  void option(const std::string& flag, T& value, const std::string& what, Need need = Need::optional);

  void choice(const std::string& flag, std::string& value, const std::vector<std::string>& allowed,
              const std::string& what);

  // True when given.
  void toggle(const std::string& flag, bool& value, const std::string& what);

  // False when --help or --version has printed all there is to say. Throws InputError that names the flag.
  [[nodiscard]] bool parse(int argc, const char* const* argv);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

// What every main() does: names the log, runs `body` and returns its exit code; prints an InputError as one line and
// returns kExitBadInput; any other exception returns 1.
int run_program(const std::string& program, const std::function<int()>& body);

}  // namespace sectio
