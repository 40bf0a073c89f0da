// A camera as a scene names it, as a server sends it and as a viewer draws it.
#pragma once

#include "common/math/types.h"

namespace sectio {

// Scenes are made for pictures at least so wide. A narrower one, of a phone that is held upright, is as wide and shows
// more above and below.
constexpr double kNarrowestAspect = 4.0 / 3;

struct Camera {
  Vec3 eye_world_m{0.0, -0.4, 0.3};
  Vec3 target_world_m = Vec3::Zero();
  Vec3 up_world = Vec3::UnitZ();
  double field_of_view_deg = 35;  // vertical

  bool operator==(const Camera&) const = default;
};

}  // namespace sectio
