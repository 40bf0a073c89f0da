// The textures of the procedural materials: small periodic volumes of noise, looked up at rest coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/math/types.h"

namespace sectio {

constexpr int kTissueNoiseSize = 64;

// Each volume has kTissueNoiseSize^3 texels of 4 bytes, x fastest, and is periodic in all three directions.
struct TissueNoise {
  std::vector<std::uint8_t> noise;   // r soft clouds; g distance to the nearest cell centre; b fine grain; a vessels
  std::vector<std::uint8_t> relief;  // rgb gradient of a bumpy height, 128 is zero; a mottling by lobules
};
// Always the same; made at the first call, in about 0.3 s. Any thread.
const TissueNoise& tissue_noise();

// `noise` at texture coordinates, as a shader would look it up: vertices carry it where they are close enough.
std::array<std::uint8_t, 4> noise_at(const Vec3f& coordinates);
// The broad pattern of skin at a rest point.
inline std::array<std::uint8_t, 4> broad_pattern_at(const Vec3f& rest_m) {
  return noise_at(9.0f * rest_m + Vec3f::Constant(0.37f));
}
// Skin whose edges are longer than this on average can't carry the broad pattern on its vertices: the smallest clouds
// are 7 mm wide.
constexpr float kCoarseSkin_m = 0.005f;

}  // namespace sectio
