#include "sim_server/session/tremor_gauge.h"

#include <algorithm>
#include <cmath>

namespace sectio {

TremorGauge::TremorGauge(double step_s)
    : half_(std::max<std::size_t>(2, static_cast<std::size_t>(std::lround(0.5 * kWindow_s / step_s)))) {}

// With n = 2 m + 1 samples, the parabola is at the middle one sum_k w_k x_k,
//   w_k = 3 (3 m^2 + 3 m - 1 - 5 k^2) / ((2 m - 1) (2 m + 1) (2 m + 3)).
void TremorGauge::add(const Vec3& tip_world_m, bool counts) {
  const std::size_t count = 2 * half_ + 1;
  if (tips_world_m_.size() < count) {
    tips_world_m_.push_back(tip_world_m);
    counts_.push_back(counts);
  } else {
    tips_world_m_[next_] = tip_world_m;
    counts_[next_] = counts;
    next_ = (next_ + 1) % count;
  }
  const std::size_t middle = (next_ + half_) % count;
  if (tips_world_m_.size() < count || !counts_[middle]) return;
  const auto m = static_cast<double>(half_);
  const double scale = 3 / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3)), most = 3 * m * m + 3 * m - 1;
  Vec3 smooth_world_m = Vec3::Zero();
  double way_m = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double k = static_cast<double>(i) - m;
    const Vec3& at_m = tips_world_m_[(next_ + i) % count];
    smooth_world_m += scale * (most - 5 * k * k) * at_m;
    if (i > 0) way_m += (at_m - tips_world_m_[(next_ + i - 1) % count]).norm();
  }
  if (way_m < kLeastWay_m) return;
  square_m2_ += (tips_world_m_[middle] - smooth_world_m).squaredNorm();
  if (++samples_ < half_) return;
  squares_m2_.push_back(square_m2_ / static_cast<double>(samples_));
  square_m2_ = 0;
  samples_ = 0;
}

double TremorGauge::rms_m() const {
  if (squares_m2_.empty()) return 0;
  std::vector<double> sorted = squares_m2_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  return std::sqrt(*middle);
}

}  // namespace sectio
