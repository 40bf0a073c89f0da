// The 1 kHz loop: pose in, force out. Everything else is handed to threads that may wait.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

#include "common/core/latest_value.h"
#include "device_bridge/device/device.h"
#include "device_bridge/servo/ring.h"
#include "device_bridge/servo/servo_link.h"
#include "device_bridge/servo/servo_state.h"

namespace sectio {

// The loop's account of itself; each member has one reading thread.
struct ServoLog {
  Ring<ServoRecord> records{16384};               // every tick, for the file
  LatestValue<ServoRecord> newest;                // for the progress line
  std::atomic<std::uint64_t> dropped_records{0};  // `records` was full: the disk is too slow
  std::atomic<DeviceStatus> device_status{DeviceStatus::ready};
};

struct ServoTiming {
  std::int64_t period_ns = 1'000'000;
  double duration_s = std::numeric_limits<double>::infinity();
};

// Runs in the calling thread until the device has finished, the duration is over or `stop` is set; leaves the device
// without force. Wakes at absolute times of CLOCK_MONOTONIC. A tick that comes a whole period late or more counts as
// overrun, and missed ticks are left out, never caught up. A tick's time is the time at which it was due, since the
// beginning. Neither allocates, locks nor does I/O.
void run_servo(Device& device, ServoLink& link, ServoState& state, ServoLog& log, const ServoTiming& timing,
               const std::atomic<bool>& stop);

// SCHED_FIFO for the calling thread; false when the system does not permit it.
[[nodiscard]] bool request_real_time();

}  // namespace sectio
