#include "device_bridge/servo/servo_loop.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "tests/unit/servo/allocation_count.h"

namespace sectio::servo_test {
namespace {

// Rests at one place for a number of ticks, and remembers what it felt and what was allocated between them.
class CountingDevice : public Device {
 public:
  explicit CountingDevice(std::uint64_t ticks) : ticks_left_(ticks) {}

  Pose pose_world(double) override {
    if (!began_) at_begin_ = allocations_of_this_thread();
    began_ = true;
    return {Vec3(0, 0, -0.001), Eigen::Quaterniond::Identity()};
  }
  void apply(const Vec3& force_world_n) override {
    force_n = force_world_n;
    largest_n = std::max(largest_n, force_world_n.norm());
    allocated = allocations_of_this_thread() - at_begin_;
    if (ticks_left_ > 0) --ticks_left_;
  }
  bool finished(double) const override { return ticks_left_ == 0; }

  Vec3 force_n = Vec3::Zero();
  double largest_n = 0;
  std::uint64_t allocated = 0;

 private:
  std::uint64_t ticks_left_;
  std::uint64_t at_begin_ = 0;
  bool began_ = false;
};

ContactModel pushing() {
  ContactModel model;
  model.force_world_n = Vec3(0, 0, 1);
  model.state = ContactState::contact;
  model.stiffness_n_per_m = 200;
  return model;
}

// A server that answers each sample.
class TestLink : public ServoLink {
 public:
  TestLink() { samples.reserve(1000); }
  void publish(const PoseSample& sample) override {
    if (samples.size() < samples.capacity()) samples.push_back(sample);
    published.store(true);
    ContactModel answer = pushing();
    answer.tool_time_s = sample.tool_time_s;
    models.store(answer);
  }
  bool latest_model(ContactModel& model) override { return models.load(model); }

  LatestValue<ContactModel> models;
  std::vector<PoseSample> samples;
  std::atomic<bool> published = false;
};

struct Loop {
  TestLink link;
  ServoState state;
  ServoLog log;
  std::atomic<bool> stop = false;

  void run(Device& device, const ServoTiming& timing = {}) { run_servo(device, link, state, log, timing, stop); }
  ServoRecord last() {
    ServoRecord record;
    EXPECT_TRUE(log.newest.load(record));
    return record;
  }
};

TEST(ServoLoop, neither_allocates_nor_loses_a_tick) {
  CountingDevice device(100);
  Loop loop;
  loop.run(device);

  EXPECT_EQ(device.allocated, 0U);
  EXPECT_GT(device.largest_n, 0.9);
  EXPECT_EQ(device.force_n, Vec3::Zero()) << "the hand must be left without force";
  ASSERT_EQ(loop.link.samples.size(), 100U);
  double last_s = -1;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    const PoseSample& sample = loop.link.samples[i - 1];
    ServoRecord record;
    ASSERT_TRUE(loop.log.records.pop(record));
    EXPECT_EQ(sample.sequence, i);
    EXPECT_EQ(record.sample.sequence, i);
    EXPECT_GT(sample.tool_time_s, last_s);
    last_s = sample.tool_time_s;
    // A tick is either made or counted as missed.
    EXPECT_EQ(std::llround(sample.tool_time_s * 1000), static_cast<long long>(i - 1 + record.overruns));
  }
}

// A device that needs longer than the period: ticks are left out and counted, time does not fall behind.
class SlowDevice : public CountingDevice {
 public:
  using CountingDevice::CountingDevice;
  Pose pose_world(double now_s) override {
    const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(2500);
    while (std::chrono::steady_clock::now() < until) {
    }
    return CountingDevice::pose_world(now_s);
  }
};

TEST(ServoLoop, counts_overruns) {
  SlowDevice device(10);
  Loop loop;
  loop.run(device);
  EXPECT_GE(loop.last().overruns, 9U);
}

// The device is asked right after the loop has woken, and reads the clock then. The loop began between the reading
// before it and the one that the first waking allows.
TEST(ServoLoop, tells_when_it_really_woke) {
  class WakingDevice : public CountingDevice {
   public:
    WakingDevice() : CountingDevice(50) { asked_s.reserve(50); }
    Pose pose_world(double now_s) override {
      asked_s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count());
      return CountingDevice::pose_world(now_s);
    }
    std::vector<double> asked_s;
  } device;
  Loop loop;
  const std::chrono::duration<double> before = std::chrono::steady_clock::now().time_since_epoch();
  loop.run(device);
  ASSERT_EQ(device.asked_s.size(), 50U);
  const double earliest_s = before.count();
  double latest_s = 0;
  ServoRecord record;
  for (std::size_t i = 0; loop.log.records.pop(record); ++i) {
    EXPECT_GE(record.woke_after_s, 0);
    EXPECT_LT(record.woke_after_s, 0.001);
    const double woke_s = record.sample.tool_time_s + record.woke_after_s;
    if (i == 0) latest_s = device.asked_s[0] - woke_s;
    EXPECT_LE(earliest_s + woke_s, device.asked_s[i]) << "tick " << i << " was asked after its waking";
    if (i > 0) {
      EXPECT_GT(latest_s + woke_s, device.asked_s[i - 1]) << "tick " << i << " woke after the one before";
    }
  }
}

TEST(ServoLoop, stops_when_told) {
  CountingDevice device(1'000'000);
  Loop loop;
  std::thread thread([&] { loop.run(device); });
  while (!loop.link.published) std::this_thread::yield();
  loop.stop = true;
  thread.join();
  EXPECT_EQ(device.force_n, Vec3::Zero());
}

TEST(ServoLoop, ends_with_its_duration) {
  CountingDevice device(1'000'000);
  Loop loop;
  loop.run(device, {.duration_s = 0.02});
  EXPECT_LE(loop.last().sample.tool_time_s, 0.02);
}

TEST(ServoLoop, a_full_log_is_counted_and_delays_nothing) {
  CountingDevice device(4);
  Loop loop;
  while (loop.log.records.push({})) {
  }
  loop.run(device);
  EXPECT_EQ(loop.log.dropped_records, 4U);
  EXPECT_EQ(loop.link.samples.size(), 4U);
}

TEST(Ring, keeps_order_between_threads) {
  Ring<std::uint64_t> ring(7);
  constexpr std::uint64_t kLast = 100'000;
  std::thread producer([&] {
    for (std::uint64_t i = 1; i <= kLast;) {
      if (ring.push(i)) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t value = 0;
  std::uint64_t wrong = 0;
  for (std::uint64_t expected = 1; expected <= kLast;) {
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    wrong += value != expected++;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace sectio::servo_test
