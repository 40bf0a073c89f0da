#include "sim_server/net/handover.h"

#include <chrono>
#include <utility>

namespace sectio {

void Handover::put(const std::function<void(Outbox&)>& put) {
  bool urgent = false;
  {
    const std::lock_guard lock(mutex_);
    put(outbox_);
    urgent = outbox_.urgent();
  }
  if (urgent) wake_.notify_one();
}

void Handover::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
}

void Handover::resume() {
  const std::lock_guard lock(mutex_);
  stop_ = false;
}

SessionEnd Handover::wait_for_end() {
  std::unique_lock lock(mutex_);
  ended_.wait(lock, [&] { return report_.end.has_value(); });
  return *report_.end;
}

void Handover::show_life(double for_s) {
  using Clock = std::chrono::steady_clock;
  alive_until_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(for_s));
}

bool Handover::shows_life() const {
  return std::chrono::steady_clock::now() < alive_until_.load();
}

bool Handover::pick_up(Outbox& batch, double patience_s) {
  std::unique_lock lock(mutex_);
  if (!outbox_.urgent() && !stop_) wake_.wait_for(lock, std::chrono::duration<double>(patience_s));
  if (stop_ && !outbox_.urgent()) return false;
  std::swap(batch, outbox_);
  outbox_.go_on_from(batch);
  return true;
}

void Handover::report(const PublisherReport& report) {
  {
    const std::lock_guard lock(mutex_);
    report_ = report;
  }
  if (report.end) ended_.notify_all();
}

PublisherReport Handover::last_report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

}  // namespace sectio
