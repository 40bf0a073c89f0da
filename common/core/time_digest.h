// Durations in a fixed number of bytes, however many there are: a session may go on for days.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace sectio {

class TimeDigest {
 public:
  void add(double time_s) {
    const double bin = time_s > kLeast_s ? kBinsPerOctave * std::log2(time_s / kLeast_s) : 0;
    ++counts_[static_cast<std::size_t>(std::min(bin, kBins - 1.0))];
    ++count_;
    total_s_ += time_s;
  }
  double total_s() const { return total_s_; }
  std::uint64_t count() const { return count_; }
  // The duration below which a fraction q of them lies, within 1 % between 10 ns and half an hour; 0 without any.
  double quantile(double q) const {
    if (count_ == 0) return 0;
    const auto before = static_cast<std::uint64_t>(q * static_cast<double>(count_ - 1));
    std::size_t bin = 0;
    for (std::uint64_t sum = counts_[0]; sum <= before; sum += counts_[++bin]) {
    }
    return kLeast_s * std::exp2((static_cast<double>(bin) + 0.5) / kBinsPerOctave);
  }

 private:
  static constexpr double kLeast_s = 1e-8;
  static constexpr double kBinsPerOctave = 40;
  static constexpr std::size_t kBins = 1500;

  std::array<std::uint64_t, kBins> counts_{};
  std::uint64_t count_ = 0;
  double total_s_ = 0;
};

}  // namespace sectio
