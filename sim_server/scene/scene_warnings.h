// Scenes that can be simulated, but hardly as they were meant.
#pragma once

#include <string>
#include <vector>

#include "sim_server/scene/scene.h"

namespace sectio {

// A line each, for a person: material beyond soft tissue, traces that outlast the run, never come near a body or never
// move jaws, bodies that overlap or reach below the floor, regions outside their body, volumes that nothing holds. The
// scene is the one to be simulated, its volumes filled; duration_s may be infinite. Milliseconds.
std::vector<std::string> scene_warnings(const Scene& scene, double duration_s);

}  // namespace sectio
