// The maximum of many values of which few change at a time: O(log n) for a change, O(1) for the maximum.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <vector>

namespace sectio {

// Values are >= 0; entries never set count as 0.
class MaxTree {
 public:
  double max() const { return nodes_.empty() ? 0 : nodes_[1]; }
  double operator[](std::size_t i) const { return i < leaves_ ? nodes_[leaves_ + i] : 0; }

  void set(std::size_t i, double value) {
    if (i >= leaves_) grow(i + 1);
    std::size_t n = leaves_ + i;
    nodes_[n] = value;
    for (n /= 2; n > 0; n /= 2) {
      const double greater = std::max(nodes_[2 * n], nodes_[2 * n + 1]);
      if (nodes_[n] == greater) break;
      nodes_[n] = greater;
    }
  }

  template <class A>
  void archive(A& a) {
    a(nodes_, leaves_);
  }

 private:
  void grow(std::size_t size) {
    std::vector<double> values(nodes_.begin() + static_cast<std::ptrdiff_t>(leaves_), nodes_.end());
    leaves_ = std::bit_ceil(std::max<std::size_t>(size, 2));
    nodes_.assign(2 * leaves_, 0);
    std::copy(values.begin(), values.end(), nodes_.begin() + static_cast<std::ptrdiff_t>(leaves_));
    for (std::size_t n = leaves_ - 1; n > 0; --n) nodes_[n] = std::max(nodes_[2 * n], nodes_[2 * n + 1]);
  }

  std::vector<double> nodes_;  // a heap: node n has children 2n and 2n + 1, leaves from leaves_ on
  std::size_t leaves_ = 0;
};

}  // namespace sectio
