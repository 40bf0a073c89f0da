// Another program as a test's child: its output line by line, signals, and an end without orphans.
#pragma once

#include <signal.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace sectio::test {

class Process {
 public:
  // Starts `program` with both of its outputs in one pipe, on a host of a VirtualNetwork if one is given. It dies with
  // the test, whatever happens.
  Process(const std::string& program, const std::vector<std::string>& arguments, int host = -1);

  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal_number) const { ::kill(pid_, signal_number); }

  // True once a line holds `text`; lines that came before this call count too. False when the program ends without it,
  // or after the time.
  bool wait_for(const std::string& text, std::chrono::seconds time = std::chrono::seconds(60));

  // Like wait_for(), but only text that is printed after this call counts.
  bool wait_for_next(const std::string& text, std::chrono::seconds time = std::chrono::seconds(60));

  // The exit code, or 128 + signal; nothing when it still runs after the time.
  std::optional<int> exit_code(std::chrono::seconds time = std::chrono::seconds(60));

  const std::string& name() const { return name_; }
  pid_t id() const { return pid_; }
  const std::string& output() const { return output_; }

 private:
  using Clock = std::chrono::steady_clock;

  // False at the end of the output and after the deadline.
  bool read_more(Clock::time_point deadline);

  std::string name_;
  pid_t pid_ = -1;
  int output_end_ = -1;
  bool at_end_ = false;
  std::string output_;
  std::optional<int> exit_code_;
};

// The number of cuts in the last progress that a server has printed; 0: it has printed none.
int cuts_told_by(const Process& server);

}  // namespace sectio::test
