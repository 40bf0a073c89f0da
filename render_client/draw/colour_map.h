// The colours of a scalar field: viridis (van der Walt and Smith 2015), dark blue to yellow, which grows evenly in
// lightness. Five stops, linear between them.
#pragma once

#include <array>

#include "common/math/types.h"
#include "render_client/draw/image.h"

namespace sectio {

// Red, green, blue as on a screen, 0 to 1.
inline const std::array<Vec3f, 5> kColourMap{Vec3f(0.267f, 0.005f, 0.329f), Vec3f(0.229f, 0.322f, 0.546f),
                                             Vec3f(0.128f, 0.567f, 0.551f), Vec3f(0.369f, 0.789f, 0.383f),
                                             Vec3f(0.993f, 0.906f, 0.144f)};

// share: 0 to 1.
Colour map_colour(float share);

}  // namespace sectio
