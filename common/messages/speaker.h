// Several programs may speak for one instrument: one that was started again, one by mistake, a malicious one. The
// program that spoke first keeps the instrument until it has been silent for kSilence_s. Clocks of other programs are
// not used.
#pragma once

#include <cstdint>
#include <optional>

namespace sectio {

class Speaker {
 public:
  static constexpr double kSilence_s = 0.1;  // bridges speak forty times a second, or more often

  // True when the source speaks for the instrument now. `now_s` ascends.
  bool hears(std::uint64_t source, double now_s) {
    if (source_ && *source_ != source && now_s - heard_s_ <= kSilence_s) return false;
    source_ = source;
    heard_s_ = now_s;
    return true;
  }
  std::optional<std::uint64_t> source() const { return source_; }
  // How long nobody has spoken; nothing before the first word.
  std::optional<double> silent_s(double now_s) const {
    return source_ ? std::optional(now_s - heard_s_) : std::nullopt;
  }

 private:
  std::optional<std::uint64_t> source_;
  double heard_s_ = 0;
};

}  // namespace sectio
