// How well surfaces follow the instruments that press them: `sim_server gap`.
#pragma once

#include <string>

#include "sim_server/scene/scene.h"

namespace sectio {

// Runs the scene on its own traces. A line for each body: how far pressing instruments were from the surface that they
// dented.
std::string measure_gaps(const Scene& scene);

}  // namespace sectio
