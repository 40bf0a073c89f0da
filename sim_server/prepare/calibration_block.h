// The block on which a machine's speed is measured: 60 x 60 x 40 mm, held at its lower face.
#pragma once

#include "sim_server/planning/method.h"
#include "sim_server/scene/scene.h"

namespace sectio {

constexpr double kBlockCell_m = 0.01;  // a lattice in it has such cells
constexpr double kBlockVolume_m3 = 0.06 * 0.06 * 0.04;
constexpr double kSurfaceEdge_m = kBlockCell_m / 3;  // its surface alone has such squares

// The block filled with about so many tetrahedra.
Scene filled_block(double tetrahedra);
// With the model and the driver of a method.
Scene with_model(Scene scene, const planning::Method& method, double young_pa, double cell_m = kBlockCell_m);
// Its surface alone.
Scene surface_block();

}  // namespace sectio
