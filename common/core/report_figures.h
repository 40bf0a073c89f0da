// Figures as the reports of several programs write them.
#pragma once

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "common/core/formatted.h"

namespace sectio {

// The value below which a fraction q of the samples lies; 0 without samples.
template <class T>
double quantile(std::vector<T> samples, double q) {
  if (samples.empty()) return 0;
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(samples.size() - 1));
  std::nth_element(samples.begin(), at, samples.end());
  return static_cast<double>(*at);
}

// 16 hexadecimal digits.
inline std::string hash_text(std::uint64_t hash) {
  return formatted("%016" PRIx64, hash);
}

}  // namespace sectio
