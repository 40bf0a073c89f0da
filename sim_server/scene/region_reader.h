// The key `regions:` of a body in a scene file.
#pragma once

#include "common/material/regions.h"
#include "sim_server/scene/key_reader.h"

namespace sectio {

// Reads `regions` of a body's map. Throws InputError.
Regions read_regions(KeyReader& body);

}  // namespace sectio
