// Orders come from people, who click a few times a second. A program that gives more is not heard until it has been
// quiet for a while, so that it takes no time from the session; it takes none from the orders of other programs either,
// until several give too many at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/core/token_bucket.h"
#include "common/messages/epoch.h"
#include "common/messages/session.h"

namespace sectio {

class OrderLimit {
 public:
  struct Rate {
    double per_s, burst;
  };
  static constexpr Rate kOfOne{10, 20}, kOfAll{40, 80};
  // Orders that take longer than a step: to set up the session once more, from its beginning or another moment, and to
  // weigh what is on the table.
  static constexpr Rate kLongOfOne{1, 8}, kLongOfAll{3, 24};
  static constexpr double kQuiet_s = 2;

  // Whether an order of this program may be obeyed now. `now_s`: any steady clock.
  bool allows(const ProgramId& program, OrderKind kind, double now_s);
  std::uint64_t refused() const { return refused_; }

 private:
  static constexpr std::size_t kMostPrograms = 64;  // so many find room on a host
  struct Buckets {
    Buckets(const Rate& a, const Rate& b) : any(a.per_s, a.burst), long_ones(b.per_s, b.burst) {}
    TokenBucket any, long_ones;
  };
  struct Program {
    ProgramId id{};
    Buckets buckets{kOfOne, kLongOfOne};
    double spoke_s = 0;
    bool is_flood = false;
  };
  Program& known(const ProgramId& program);

  std::deque<Program> programs_;  // the longest known first
  Buckets all_{kOfAll, kLongOfAll};
  std::uint64_t refused_ = 0;
};

}  // namespace sectio
