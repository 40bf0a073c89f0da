// A scene as it was read becomes one that can be simulated: its models are chosen, its volumes filled.
#pragma once

#include "sim_server/engine/engine_table.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// Reads files, runs meshers as child processes, and measures this machine when a body is auto; a Simulation does
// nothing of the kind. Throws InputError that names scene and body.
Scene prepared(Scene scene, const EngineTable& engines);
Scene prepared(Scene scene);  // with the standard engines

}  // namespace sectio
