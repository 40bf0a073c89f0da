// The cells of a heat map: their edges along an axis, and their colours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/core/sort_unique.h"
#include "render_client/draw/image.h"

namespace sectio {

// The edges of cells around the values of a row: half way between neighbours, and as far beyond the first and the last.
class CellEdges {
 public:
  explicit CellEdges(std::vector<double> values) : values_(std::move(values)) {
    sort_unique(values_);
    if (values_.empty()) values_.push_back(0);
    const std::size_t last = values_.size() - 1;
    edges_.push_back(last > 0 ? 1.5 * values_[0] - 0.5 * values_[1] : values_[0] - 0.5);
    for (std::size_t i = 0; i < last; ++i) edges_.push_back(0.5 * (values_[i] + values_[i + 1]));
    edges_.push_back(last > 0 ? 1.5 * values_[last] - 0.5 * values_[last - 1] : values_[0] + 0.5);
  }
  std::pair<double, double> of(double value) const {
    const auto i = static_cast<std::size_t>(std::lower_bound(values_.begin(), values_.end(), value) - values_.begin());
    return {edges_[i], edges_[i + 1]};
  }
  double low() const { return edges_.front(); }
  double high() const { return edges_.back(); }

 private:
  std::vector<double> values_, edges_;
};

// Pale, amber, red for a share from 0 to 1; grey for a share that is not finite.
inline Colour heat_colour(double share) {
  constexpr std::array<std::array<double, 3>, 3> kStops{{{232, 238, 244}, {246, 186, 96}, {158, 24, 38}}};
  if (!std::isfinite(share)) return {150, 154, 160, 255};
  const double at = 2 * std::clamp(share, 0.0, 1.0);
  const std::size_t stop = at < 1 ? 0 : 1;
  const auto mix = [&](std::size_t k) {
    return static_cast<std::uint8_t>(
        std::lround(kStops[stop][k] + (at - double(stop)) * (kStops[stop + 1][k] - kStops[stop][k])));
  };
  return {mix(0), mix(1), mix(2), 255};
}

}  // namespace sectio
