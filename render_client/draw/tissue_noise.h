// The textures of the procedural materials: small periodic volumes of noise, looked up at rest coordinates.
#pragma once

#include <cstdint>
#include <vector>

namespace sectio {

constexpr int kTissueNoiseSize = 64;

// Both: kTissueNoiseSize^3 texels of 4 bytes, x fastest, periodic in all three directions, always the same.
struct TissueNoise {
  std::vector<std::uint8_t> noise;   // r soft clouds; g distance to the nearest cell centre; b fine grain; a vessels
  std::vector<std::uint8_t> relief;  // rgb gradient of a bumpy height, 128 is zero; a mottling by lobules
};
TissueNoise make_tissue_noise();

}  // namespace sectio
