// Model surface_springs: a body that is its surface. SurfaceTree, SurfaceCutting, SurfaceSplitting, SurfaceSprings.
#pragma once

#include "sim_server/engine/engine_table.h"

namespace sectio {

BodyEngines surface_spring_engines(const EngineSite& site);

}  // namespace sectio
