// A queue of fixed size from one thread to one other, without lock or allocation: how the servo loop hands its samples
// and its log to threads that may wait.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace sectio {

template <class T>
class Ring {
 public:
  // Holds up to `capacity` values; all memory is taken here.
  explicit Ring(std::size_t capacity) : slots_(capacity + 1) {}

  // Producer's thread. False when full: the value is dropped.
  bool push(const T& value) {
    const std::size_t end = end_.load(std::memory_order_relaxed);
    const std::size_t next = after(end);
    if (next == begin_.load(std::memory_order_acquire)) return false;
    slots_[end] = value;
    end_.store(next, std::memory_order_release);
    return true;
  }

  // Consumer's thread. False when empty.
  bool pop(T& value) {
    const std::size_t begin = begin_.load(std::memory_order_relaxed);
    if (begin == end_.load(std::memory_order_acquire)) return false;
    value = slots_[begin];
    begin_.store(after(begin), std::memory_order_release);
    return true;
  }

 private:
  std::size_t after(std::size_t index) const { return index + 1 == slots_.size() ? 0 : index + 1; }

  std::vector<T> slots_;
  alignas(64) std::atomic<std::size_t> begin_{0};
  alignas(64) std::atomic<std::size_t> end_{0};
};

}  // namespace sectio
