// A clock that is behind: loaded before a program (LD_PRELOAD), it takes SECTIO_CLOCK_BEHIND_S seconds off the date,
// also for waits until a date, which would be over at once else.
#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>

namespace {

constexpr std::time_t kDates_s = 1'000'000'000;  // a lesser time is of a clock that counts from the machine's start

std::time_t behind_s() {
  static const std::time_t behind = [] {
    const char* text = std::getenv("SECTIO_CLOCK_BEHIND_S");
    return text ? std::atol(text) : 0;
  }();
  return behind;
}

timespec true_time(timespec time) {
  if (time.tv_sec > kDates_s) time.tv_sec += behind_s();
  return time;
}

template <class F>
F next(F, const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t id, timespec* time) noexcept {
  const long result = syscall(SYS_clock_gettime, id, time);
  if (result == 0 && id == CLOCK_REALTIME) time->tv_sec -= behind_s();
  return static_cast<int>(result);
}

int gettimeofday(timeval* time, void*) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}

std::time_t time(std::time_t* time) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (time) *time = now.tv_sec;
  return now.tv_sec;
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* until) {
  static const auto wait = next(pthread_cond_timedwait, "pthread_cond_timedwait");
  const timespec then = true_time(*until);
  return wait(condition, mutex, &then);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  static const auto lock = next(pthread_mutex_timedlock, "pthread_mutex_timedlock");
  const timespec then = true_time(*until);
  return lock(mutex, &then);
}

int sem_timedwait(sem_t* semaphore, const timespec* until) {
  static const auto wait = next(sem_timedwait, "sem_timedwait");
  const timespec then = true_time(*until);
  return wait(semaphore, &then);
}

}  // extern "C"
