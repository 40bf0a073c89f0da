#include "common/core/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "common/core/wall_time.h"

namespace sectio {
namespace {

// The child does this with its descriptors before it becomes the program.
class SpawnActions {
 public:
  explicit SpawnActions(const ChildOptions& options) {
    posix_spawn_file_actions_init(&actions_);
    int last = STDERR_FILENO;
    for (const auto& [here, there] : options.descriptors) {
      posix_spawn_file_actions_adddup2(&actions_, here, there);
      last = std::max(last, there);
    }
    for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
      const auto is_named = [&](const auto& d) { return d.second == standard; };
      if (!options.is_quiet || std::ranges::any_of(options.descriptors, is_named)) continue;
      const int flags = standard == STDIN_FILENO ? O_RDONLY : O_WRONLY;
      posix_spawn_file_actions_addopen(&actions_, standard, "/dev/null", flags, 0);
    }
    posix_spawn_file_actions_addclosefrom_np(&actions_, last + 1);
    posix_spawnattr_init(&attributes_);
    if (options.has_own_group) posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETPGROUP);
  }
  ~SpawnActions() {
    posix_spawnattr_destroy(&attributes_);
    posix_spawn_file_actions_destroy(&actions_);
  }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;

  int spawn(char* const* argv, pid_t& pid) const {
    return ::posix_spawnp(&pid, argv[0], &actions_, &attributes_, argv, environ);
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

ChildProcess::Ending ending_of(int status) {
  if (WIFSIGNALED(status)) return {false, std::string("crashed (") + ::strsignal(WTERMSIG(status)) + ")"};
  return {WEXITSTATUS(status) == 0, "ended with code " + std::to_string(WEXITSTATUS(status))};
}

}  // namespace

ChildProcess::ChildProcess(std::vector<std::string> words, const ChildOptions& options) {
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  if (const int error = SpawnActions(options).spawn(argv.data(), pid_); error != 0)
    throw std::system_error(error, std::generic_category(), words.front());
}

ChildProcess::~ChildProcess() {
  kill();
  wait();
}

void ChildProcess::kill() {
  if (pid_ > 0) ::kill(pid_, SIGKILL);
}

ChildProcess::Ending ChildProcess::wait() {
  if (pid_ <= 0) return ending_;
  int status = 0;
  pid_t done = 0;
  do done = ::waitpid(pid_, &status, 0);
  while (done < 0 && errno == EINTR);
  ending_ = done == pid_ ? ending_of(status) : Ending{false, "is gone"};
  pid_ = -1;
  return ending_;
}

std::optional<ChildProcess::Ending> ChildProcess::wait_for(double limit_s) {
  if (pid_ <= 0) return ending_;
  const int watched = static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0));  // glibc 2.36 declares it for C alone
  if (watched < 0) return wait();
  const double until_s = steady_now_s() + limit_s;
  int ready = 0;
  do {
    const double left_s = std::clamp(until_s - steady_now_s(), 0.0, 3600.0);
    pollfd ended{watched, POLLIN, 0};
    ready = ::poll(&ended, 1, static_cast<int>(1000 * left_s) + 1);
  } while (ready <= 0 && steady_now_s() < until_s);
  ::close(watched);
  if (ready <= 0) return std::nullopt;
  return wait();
}

}  // namespace sectio
