// The keys of a body in a scene file.
#pragma once

#include "sim_server/scene/key_reader.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// Paths stay as they are in the file; no other file is read. All throw InputError.
BodySpec read_body(KeyReader& map, const EngineTraits& traits);

Box read_box(KeyReader& map);

}  // namespace sectio
