// A scene simulated here and drawn without a network; and what each pixel of the picture shows, found by a rasteriser
// of the test's own.
#pragma once

#include <optional>
#include <vector>

#include "deploy/pictures/scene_frame.h"

namespace sectio::test {

struct SeenPoint {
  std::size_t body = 0;
  Surface surface = Surface::skin;
  Vec3 rest_m;
  Vec3 world_m;
};

// By pixel, rows from the top; nothing where there is no body.
std::vector<std::optional<SeenPoint>> seen_points(const Frame& frame, int width_px, int height_px);

}  // namespace sectio::test
