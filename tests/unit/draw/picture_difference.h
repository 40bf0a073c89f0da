// How much two pictures of the same size differ.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "render_client/draw/image.h"

namespace sectio::test {

// The difference of one pixel: the largest over red, green and blue, in levels of 255.
inline int difference(const Image& a, const Image& b, int x, int y) {
  int d = 0;
  for (int k = 0; k < 3; ++k) d = std::max(d, std::abs(a.pixel(x, y)[k] - b.pixel(x, y)[k]));
  return d;
}

inline int pixels_that_differ(const Image& a, const Image& b, int by_more_than) {
  int count = 0;
  for (int y = 0; y < a.height_px; ++y)
    for (int x = 0; x < a.width_px; ++x) count += difference(a, b, x, y) > by_more_than;
  return count;
}

// Mean of difference() over the picture.
inline double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (int y = 0; y < a.height_px; ++y)
    for (int x = 0; x < a.width_px; ++x) sum += difference(a, b, x, y);
  return sum / (a.width_px * a.height_px);
}

}  // namespace sectio::test
