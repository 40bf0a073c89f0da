// How long a test waits for what must come about.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace sectio::test {

constexpr std::chrono::seconds kGiveUp{60}, kGiveUpDevice{30};

// Does `meanwhile` and waits a millisecond until the condition holds; false: it never did.
inline bool wait_until(const std::function<bool()>& condition, const std::function<void()>& meanwhile = {},
                       std::chrono::seconds give_up = kGiveUp) {
  const auto end = std::chrono::steady_clock::now() + give_up;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    if (meanwhile) meanwhile();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace sectio::test
