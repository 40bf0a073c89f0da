#include "render_client/draw/colour_map.h"

#include <algorithm>
#include <cmath>

namespace sectio {

Colour map_colour(float share) {
  constexpr std::size_t kLast = kColourMap.size() - 1;
  const float at = static_cast<float>(kLast) * std::clamp(share, 0.0f, 1.0f);
  const std::size_t stop = std::min(static_cast<std::size_t>(at), kLast - 1);
  const Vec3f c =
      255 * (kColourMap[stop] + (at - static_cast<float>(stop)) * (kColourMap[stop + 1] - kColourMap[stop]));
  const auto byte = [](float value) { return static_cast<std::uint8_t>(std::lround(value)); };
  return {byte(c.x()), byte(c.y()), byte(c.z()), 255};
}

}  // namespace sectio
