// A clock that is behind: loaded before a program (LD_PRELOAD), it takes SECTIO_CLOCK_BEHIND_S seconds off the date.
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>

extern "C" int clock_gettime(clockid_t id, timespec* time) noexcept {
  const long result = syscall(SYS_clock_gettime, id, time);
  const char* behind_s = std::getenv("SECTIO_CLOCK_BEHIND_S");
  if (result == 0 && id == CLOCK_REALTIME && behind_s) time->tv_sec -= std::atol(behind_s);
  return static_cast<int>(result);
}
