#include "common/core/sleep_watch.h"

#include <time.h>

#include <chrono>

namespace sectio {
namespace {

// Goes on while the computer is suspended, as the steady clock does not.
double boot_now_s() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

SleepWatch::SleepWatch(double limit_s)
    : thread_([this, limit_s](const std::stop_token& stop) { run(stop, limit_s); }) {}

void SleepWatch::run(const std::stop_token& stop, double limit_s) {
  const std::chrono::duration<double> look(limit_s / 8);
  std::unique_lock lock(mutex_);
  for (double last_s = boot_now_s(); !stop.stop_requested();) {
    wake_.wait_for(lock, stop, look, [] { return false; });
    const double time_s = boot_now_s();
    if (time_s - last_s > limit_s) overslept_ = true;
    last_s = time_s;
  }
}

}  // namespace sectio
