// The models that ship, by their names in a scene.
#pragma once

#include "sim_server/engine/engine_table.h"

namespace sectio {

EngineTable standard_engines();

}  // namespace sectio
