// The looks of a body's matter, besides its colours: plain values, from the scene to the renderer.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/math/types.h"

namespace sectio {

enum class BodySurface : std::uint8_t {
  tissue,  // moist, with walls that show an inside
  plastic,
  steel,
  cloth,
};

// A layer of tissue as walls of cuts show it: skin, fat, muscle; capsule, parenchyma.
struct TissueLayer {
  double to_depth_m = 0;  // below the skin, along the wall; of the last layer: unused
  Vec3 colour = Vec3::Constant(0.5);
};
constexpr std::size_t kMaxLayers = 4;

}  // namespace sectio
