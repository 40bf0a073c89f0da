#include "sim_server/trials/trials.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/stop_signal.h"
#include "sim_server/session/offline_run.h"

namespace sectio {
namespace {

constexpr useconds_t kPause_us = 5000;  // wait() would go on through a signal

// A run in a child writes a line for each reason into a file without a name. Anything else that it prints (an
// assertion, a message of a library) goes there too, and is the reason when it ends by a signal.
struct Child {
  std::uint64_t seed = 0;
  std::FILE* said = nullptr;
};

[[noreturn]] void play(const Scene& scene, const TrialsOptions& options, const Child& child) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : stop_signals()) std::signal(number, SIG_DFL);
  dup2(fileno(child.said), STDERR_FILENO);
  const rlimit limit{options.processor_limit_s, options.processor_limit_s};
  setrlimit(RLIMIT_CPU, &limit);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  set_log_level(LogLevel::error);
  int code = 0;
  try {
    const RunResult result = run_offline(in_hand(scene, options.hand, child.seed), 0, "");
    code = result.exit_code();
    for (const std::string& reason : result.reasons) std::fprintf(stderr, "%s\n", reason.c_str());
  } catch (const std::exception& error) {
    code = kExitBadInput;
    std::fprintf(stderr, "%s\n", error.what());
  }
  std::fflush(stderr);
  _exit(code);
}

std::vector<std::string> lines_of(std::FILE* file) {
  std::rewind(file);
  std::vector<std::string> lines(1);
  for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += static_cast<char>(c);
  }
  std::erase(lines, "");
  return lines;
}

Trial judged(const Child& child, int status, const TrialsOptions& options) {
  Trial trial{child.seed, {}};
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return trial;
  trial.reasons = lines_of(child.said);
  if (!WIFSIGNALED(status)) {
    if (trial.reasons.empty()) trial.reasons = {"ended with exit code " + std::to_string(WEXITSTATUS(status))};
    return trial;
  }
  const int signal = WTERMSIG(status);
  const bool too_long = signal == SIGXCPU || signal == SIGKILL;
  const std::string last = trial.reasons.empty() ? "" : ": " + trial.reasons.back();
  trial.reasons = {too_long ? "did not end within " + std::to_string(options.processor_limit_s) + " s of processor"
                            : "crashed by signal " + std::to_string(signal) + last};
  return trial;
}

class Nursery {
 public:
  Nursery(const Scene& scene, const TrialsOptions& options) : scene_(scene), options_(options) {}
  ~Nursery() {
    for (const auto& [pid, child] : children_) {
      kill(pid, SIGKILL);
      waitpid(pid, nullptr, 0);
      std::fclose(child.said);
    }
  }

  void begin(std::uint64_t seed) {
    Child child{seed, std::tmpfile()};
    if (!child.said) throw InputError(std::string("a file for a run can't be made: ") + std::strerror(errno));
    std::fflush(stdout);
    const pid_t pid = fork();
    if (pid == 0) play(scene_, options_, child);
    if (pid < 0) throw InputError(std::string("a process can't be made: ") + std::strerror(errno));
    children_[pid] = child;
  }
  // Nothing when a stop was asked for: the same signal may have ended the run.
  std::optional<Trial> wait_for_one() {
    int status = 0;
    pid_t pid = 0;
    while (!stop_was_requested() && (pid = waitpid(-1, &status, WNOHANG)) == 0) usleep(kPause_us);
    if (stop_was_requested()) return std::nullopt;
    const Child child = children_.at(pid);
    Trial trial = judged(child, status, options_);
    std::fclose(child.said);
    children_.erase(pid);
    return trial;
  }
  std::size_t size() const { return children_.size(); }

 private:
  const Scene& scene_;
  const TrialsOptions& options_;
  std::map<pid_t, Child> children_;
};

}  // namespace

std::vector<Trial> run_trials(const Scene& scene, const TrialsOptions& options,
                              const std::function<void(const Trial&)>& done) {
  Nursery nursery(scene, options);
  std::vector<Trial> trials;
  for (std::uint32_t begun = 0; !stop_was_requested() && (begun < options.runs || nursery.size() > 0);) {
    if (begun < options.runs && nursery.size() < options.processes) {
      nursery.begin(options.seed + begun++);
      continue;
    }
    std::optional<Trial> trial = nursery.wait_for_one();
    if (!trial) break;
    trials.push_back(std::move(*trial));
    done(trials.back());
  }
  std::ranges::sort(trials, {}, &Trial::seed);
  return trials;
}

Rate rate_of(const std::vector<Trial>& trials) {
  const auto good = std::ranges::count_if(trials, [](const Trial& t) { return t.reasons.empty(); });
  return {static_cast<std::uint32_t>(good), static_cast<std::uint32_t>(trials.size())};
}

// E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.
Interval wilson(const Rate& rate) {
  if (rate.all == 0) return {};
  constexpr double kDeviations = 1.959964;
  const double n = rate.all, p = rate.good / n, spread = kDeviations * kDeviations / n;
  const double middle = (p + spread / 2) / (1 + spread);
  const double half = kDeviations / (1 + spread) * std::sqrt(p * (1 - p) / n + spread / (4 * n));
  return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

}  // namespace sectio
