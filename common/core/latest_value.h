// The newest value of a stream, handed from one thread to another without a lock: a triple buffer.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace sectio {

// One thread stores, one other thread loads; neither ever waits, and values that nobody loaded in time are lost.
// A T of a fixed size makes both calls free of allocation.
template <class T>
class LatestValue {
  static_assert(std::is_copy_assignable_v<T> && std::is_default_constructible_v<T>);

 public:
  // Called by the producer's thread only.
  void store(const T& value) {
    slots_[writing_].value = value;
    writing_ = exchanged_.exchange(static_cast<std::uint8_t>(writing_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  // Called by the consumer's thread only. True when a value has been stored since the last call; otherwise `value`
  // stays as it is.
  bool load(T& value) {
    if (!(exchanged_.load(std::memory_order_relaxed) & kFresh)) return false;
    reading_ = exchanged_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    value = slots_[reading_].value;
    return true;
  }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::size_t kCacheLine = 64;

  struct alignas(kCacheLine) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_;
  // Index of the slot that neither side owns, and whether it holds a value that was not loaded yet.
  alignas(kCacheLine) std::atomic<std::uint8_t> exchanged_{1};
  alignas(kCacheLine) std::uint8_t writing_ = 0;
  alignas(kCacheLine) std::uint8_t reading_ = 2;
};

}  // namespace sectio
