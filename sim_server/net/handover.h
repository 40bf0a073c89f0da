// How the simulation's thread hands what it has made to the network's thread, and what comes back: the only state that
// both of them touch, and the only lock between them.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>

#include "sim_server/net/outbox.h"

namespace sectio {

// How the network's thread is doing.
struct PublisherReport {
  std::uint64_t writes_refused = 0;
  double busy_s = 0;
  std::size_t copy_bytes = 0;                          // set with the end
  std::chrono::steady_clock::time_point chunk_sent{};  // time at which the last piece of a keyframe was sent
  std::optional<SessionEnd> end;                       // set when it has been sent
};

class Handover {
 public:
  // Simulation's thread. put() is called with the outbox under the lock; the network's thread wakes when the outbox
  // is urgent then.
  void put(const std::function<void(Outbox&)>& put);
  void stop();    // from now on pick_up() fails once nothing urgent is left
  void resume();  // ends the effect of stop()
  SessionEnd wait_for_end();
  // The simulation is at work, and will say so again before this time is over.
  void show_life(double for_s);

  // Network's thread. Swaps the outbox for `batch`, which is empty, when it is urgent or the patience is over. False
  // when there is no more to do.
  bool pick_up(Outbox& batch, double patience_s);
  void report(const PublisherReport& report);

  // Any thread.
  bool shows_life() const;
  PublisherReport last_report() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable ended_;
  Outbox outbox_;
  bool stop_ = false;
  PublisherReport report_;
  std::atomic<std::chrono::steady_clock::time_point> alive_until_{};
};

}  // namespace sectio
