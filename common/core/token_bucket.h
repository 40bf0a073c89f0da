// A rate for the long run, with a burst. One thread.
#pragma once

#include <algorithm>
#include <optional>

namespace sectio {

class TokenBucket {
 public:
  // It's full at first.
  TokenBucket(double per_s, double burst) : per_s_(per_s), burst_(burst), tokens_(burst) {}

  // Whether more may pass now. `now_s`: any steady clock, here and below.
  bool is_open(double now_s) {
    if (filled_s_) tokens_ = std::min(burst_, tokens_ + per_s_ * (now_s - *filled_s_));
    filled_s_ = now_s;
    return tokens_ >= 0;
  }
  // More than there is makes a debt, which is paid before anything else passes.
  void take(double amount) { tokens_ -= amount; }

 private:
  double per_s_, burst_, tokens_;
  std::optional<double> filled_s_;
};

}  // namespace sectio
