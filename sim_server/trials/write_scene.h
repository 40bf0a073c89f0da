// A scene as a file of its own.
#pragma once

#include <string>

#include "sim_server/scene/scene.h"

namespace sectio {

// Makes the directory and leaves there scene.yaml, with the scene's traces beside it and its other files named where
// they are. The scene is one that was loaded, with other traces, duration and times of gravity's turns; load_scene()
// gives these back bit for bit. Throws InputError.
void write_scene(const Scene& scene, const std::string& directory);

}  // namespace sectio
