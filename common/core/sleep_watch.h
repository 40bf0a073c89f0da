// Notices that a program was asleep: stopped, or its computer suspended. Then none of its threads runs; however busy it
// is, some do.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

namespace sectio {

class SleepWatch {
 public:
  explicit SleepWatch(double limit_s);

  // Whether it has slept for longer than the limit since this began. Any thread.
  bool overslept() const { return overslept_; }

 private:
  void run(const std::stop_token& stop, double limit_s);

  std::atomic<bool> overslept_{false};
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace sectio
