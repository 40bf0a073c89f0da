#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <regex>
#include <stdexcept>

namespace sectio::test {

Process::Process(const std::string& program, const std::vector<std::string>& arguments, int host) : name_(program) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork");
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (host >= 0 && setns(host, CLONE_NEWNET) != 0) _exit(126);
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  output_end_ = ends[0];
}

Process::~Process() {
  if (!exit_code_) {
    send(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close(output_end_);
}

bool Process::wait_for(const std::string& text, std::chrono::seconds time) {
  const auto deadline = Clock::now() + time;
  while (output_.find(text) == std::string::npos)
    if (!read_more(deadline)) return output_.find(text) != std::string::npos;
  return true;
}

bool Process::wait_for_next(const std::string& text, std::chrono::seconds time) {
  const auto deadline = Clock::now() + time;
  while (read_more(Clock::now())) {
  }
  const std::size_t from = output_.size();
  while (output_.find(text, from) == std::string::npos)
    if (!read_more(deadline)) return output_.find(text, from) != std::string::npos;
  return true;
}

std::optional<int> Process::exit_code(std::chrono::seconds time) {
  const auto deadline = Clock::now() + time;
  while (read_more(deadline)) {
  }
  if (!exit_code_ && at_end_) {
    int status = 0;
    waitpid(pid_, &status, 0);
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return exit_code_;
}

bool Process::read_more(Clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  pollfd ready{output_end_, POLLIN, 0};
  if (at_end_ || poll(&ready, 1, left > 0 ? static_cast<int>(left) : 0) <= 0) return false;
  char text[4096];
  const ssize_t size = read(output_end_, text, sizeof text);
  if (size <= 0) {
    at_end_ = true;
    return false;
  }
  output_.append(text, static_cast<std::size_t>(size));
  return true;
}

int cuts_told_by(const Process& server) {
  static const std::regex progress(R"( s simulated, (\d+) cuts)");
  const std::string& output = server.output();
  int cuts = 0;
  for (std::sregex_iterator line(output.begin(), output.end(), progress), end; line != end; ++line)
    cuts = std::stoi((*line)[1]);
  return cuts;
}

}  // namespace sectio::test
