// The scene of a journal of inputs, prepared, as its server had it.
#pragma once

#include <string>

#include "sim_server/scene/scene.h"

namespace sectio {

// The inputs in the directory of an --export; any other path is that of a file itself.
std::string journal_at(const std::string& path);

// Throws InputError for a file that is no journal of inputs, and for a scene that can't be read any more.
Scene recorded_scene(const std::string& input_log);

}  // namespace sectio
