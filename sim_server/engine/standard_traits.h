// The engines of the product as the reader of scenes sees them: load_scene(path, standard_traits()).
#pragma once

#include "sim_server/scene/engine_traits.h"

namespace sectio {

// A row for each row of standard_engines().
const EngineTraits& standard_traits();

}  // namespace sectio
