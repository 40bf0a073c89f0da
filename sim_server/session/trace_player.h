// Instruments that follow the traces of a scene, for runs without devices.
#pragma once

#include <vector>

#include "common/messages/tool.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// The samples of the scene's traces that fall into a step, one a millisecond, as a device would send them.
std::vector<ToolSample> samples_of_traces(const Scene& scene, std::uint64_t step);

// Steps of a run: `steps`, or the scene's duration when that is 0.
std::uint64_t steps_of(const Scene& scene, std::uint64_t steps);

}  // namespace sectio
