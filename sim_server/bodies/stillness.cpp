#include "sim_server/bodies/stillness.h"

#include <algorithm>
#include <utility>

namespace sectio {
namespace {

constexpr int kLooks = 16;         // observations in a window
constexpr float kGrowth = 1.5f;    // largest growth of the displacement from the first half to the second
constexpr float kNothing = 0.02f;  // share of the bound below which a displacement is ignored

}  // namespace

bool Stillness::watch(PositionsView positions_world_m, double step_s, double after_s, double bound_m) {
  if (!begun_ || from_world_m_.size() != positions_world_m.size()) {
    from_world_m_.assign(positions_world_m.begin(), positions_world_m.end());
    begun_ = true;
    time_s_ = 0;
    first_m2_ = second_m2_ = 0;
    looks_ = 0;
    return false;
  }
  time_s_ += step_s;
  if (time_s_ < after_s / 2 * (looks_ + 1) / kLooks) return false;
  ++looks_;
  const auto bound_m2 = static_cast<float>(bound_m * bound_m);
  float& largest_m2 = 2 * looks_ <= kLooks ? first_m2_ : second_m2_;
  for (std::size_t k = 0, v = liveliest_; k < positions_world_m.size(); ++k, ++v) {
    if (v >= positions_world_m.size()) v = 0;
    const float moved_m2 = (positions_world_m[v] - from_world_m_[v]).squaredNorm();
    if (!(moved_m2 <= bound_m2)) {  // true for NaN, too
      liveliest_ = v;
      begin_anew();
      return false;
    }
    largest_m2 = std::max(largest_m2, moved_m2);
  }
  if (looks_ < kLooks) return false;
  begun_ = false;
  const bool rests = second_m2_ <= std::max(kGrowth * kGrowth * first_m2_, kNothing * kNothing * bound_m2);
  return std::exchange(again_, rests) && rests;
}

}  // namespace sectio
