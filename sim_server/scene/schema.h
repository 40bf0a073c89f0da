// The description of scene files for people and for editors, written from the reader's own description of the keys.
#pragma once

#include <string>

#include "sim_server/scene/engine_traits.h"

namespace sectio {

// JSON Schema (draft 7). An editor that knows it completes keys and shows their meanings. Demands of one key on
// another are not in it; the reader checks them.
std::string scene_schema(const EngineTraits& traits);

// docs/scene.md.
std::string scene_manual(const EngineTraits& traits);

}  // namespace sectio
