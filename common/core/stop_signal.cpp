#include "common/core/stop_signal.h"

#include <csignal>

namespace sectio {
namespace {

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) {
  stop_requested = 1;
}

}  // namespace

std::vector<int> stop_signals() {
  struct sigaction hang_up {};
  sigaction(SIGHUP, nullptr, &hang_up);
  std::vector<int> signals{SIGINT, SIGTERM};
  if (hang_up.sa_handler != SIG_IGN) signals.push_back(SIGHUP);
  return signals;
}

void catch_stop_signals() {
  for (const int number : stop_signals()) std::signal(number, request_stop);
  std::signal(SIGPIPE, SIG_IGN);
}

bool stop_was_requested() {
  return stop_requested != 0;
}

}  // namespace sectio
