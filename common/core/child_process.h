// A program that this one starts. It is killed and waited for when its object ends, so that none is left behind.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sectio {

struct ChildOptions {
  // Pairs of a descriptor here and its number in the child, which gets no others.
  std::vector<std::pair<int, int>> descriptors = {};
  bool is_quiet = true;        // standard streams that `descriptors` lacks are /dev/null, else those of this program
  bool has_own_group = false;  // Ctrl-C at the terminal doesn't reach the child
};

class ChildProcess {
 public:
  struct Ending {
    bool well = false;  // the exit code was 0
    std::string text;   // for a person: "ended with code 2"
  };

  // words[0] is the program: a path, or a name that is looked up in PATH. Throws std::system_error.
  explicit ChildProcess(std::vector<std::string> words, const ChildOptions& options = {});
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  Ending wait();
  // Nothing: it has not ended within this time.
  std::optional<Ending> wait_for(double limit_s);
  void kill();

 private:
  pid_t pid_ = -1;
  Ending ending_;  // valid once the child has been waited for
};

}  // namespace sectio
