// Volumes for the bodies of a scene whose models need one. Reads files and runs meshers as child processes.
#pragma once

#include "sim_server/scene/scene.h"

namespace sectio {

// The scene with a volume for each body whose model needs one (BodySpec::tets): its surface is filled, or the volume's
// file is read. The body's mesh becomes the volume's surface, whose vertices are the first ones of the volume.
// BodySpec::mesh_notes describe the result. Throws InputError that names scene and body.
Scene fill_volumes(Scene scene);

}  // namespace sectio
