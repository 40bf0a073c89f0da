// Pictures as JPEG in memory, for pages.
#pragma once

#include <string>

#include "render_client/draw/image.h"

namespace sectio {

// Throws std::runtime_error when the library refuses.
std::string to_jpeg(const Image& image, int quality = 85);

}  // namespace sectio
