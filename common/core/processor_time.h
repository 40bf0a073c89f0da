// The processor's time of this thread, s: what others use of the machine doesn't count.
#pragma once

#include <time.h>

namespace sectio {

inline double processor_time_s() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace sectio
