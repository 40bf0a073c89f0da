// The scene of a journal of inputs, prepared, as its server had it.
#pragma once

#include <string>

#include "sim_server/scene/scene.h"

namespace sectio {

// Throws InputError for a file that is no journal of inputs, and for a scene that can't be read any more.
Scene recorded_scene(const std::string& input_log);

}  // namespace sectio
