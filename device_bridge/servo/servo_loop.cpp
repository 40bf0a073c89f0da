#include "device_bridge/servo/servo_loop.h"

#include <pthread.h>
#include <sched.h>

#include <ctime>

namespace sectio {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr int kPriority = 80;  // above what a desktop runs, below the kernel's own threads

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond_ns + now.tv_nsec;
}

void sleep_until(std::int64_t due_ns) {
  const timespec due{due_ns / kSecond_ns, due_ns % kSecond_ns};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) != 0) {
  }
}

void tick_once(Device& device, ServoLink& link, ServoState& state, ServoLog& log, double now_s, double woke_after_s,
               std::uint64_t overruns) {
  ContactModel model;
  const bool fresh = link.latest_model(model);
  const Pose pose = device.pose_world(now_s);
  log.device_status.store(device.status(), std::memory_order_relaxed);
  if (!device.present()) {
    device.apply(Vec3::Zero());
    device.apply_moment(Vec3::Zero());
    return state.rest();
  }
  ServoRecord record = state.tick(now_s, pose, fresh ? &model : nullptr);
  record.sample.opening_rad = device.opening_rad(now_s);
  record.woke_after_s = woke_after_s;
  record.overruns = overruns;
  device.apply(record.force_world_n);
  device.apply_moment(record.moment_world_n_m);
  link.publish(record.sample);
  if (!log.records.push(record)) log.dropped_records.fetch_add(1, std::memory_order_relaxed);
  log.newest.store(record);
}

}  // namespace

void run_servo(Device& device, ServoLink& link, ServoState& state, ServoLog& log, const ServoTiming& timing,
               const std::atomic<bool>& stop) {
  const std::int64_t start_ns = monotonic_ns();
  const double period_s = static_cast<double>(timing.period_ns) / static_cast<double>(kSecond_ns);
  std::uint64_t overruns = 0;
  for (std::int64_t tick = 0; !stop.load(std::memory_order_relaxed); ++tick) {
    const std::int64_t due_ns = start_ns + tick * timing.period_ns;
    sleep_until(due_ns);
    const std::int64_t late_ns = monotonic_ns() - due_ns, missed = late_ns / timing.period_ns;
    overruns += static_cast<std::uint64_t>(missed);
    tick += missed;
    const double now_s = static_cast<double>(tick) * period_s;
    if (now_s > timing.duration_s || device.finished(now_s)) break;
    const double woke_after_s = static_cast<double>(late_ns % timing.period_ns) / static_cast<double>(kSecond_ns);
    tick_once(device, link, state, log, now_s, woke_after_s, overruns);
  }
  device.apply(Vec3::Zero());
  device.apply_moment(Vec3::Zero());
}

bool request_real_time() {
  const sched_param priority{kPriority};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) == 0;
}

}  // namespace sectio
