// Volumes for the bodies of a scene whose models need one. Reads files and runs meshers as child processes.
#pragma once

#include "sim_server/engine/engine_table.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// The scene with a volume for each body whose model needs one (BodySpec::tets): its surface is filled, or the volume's
// file is read. The body's mesh becomes the volume's surface, whose vertices are the first ones of the volume.
// BodySpec::mesh_notes describe the result. A body that has a volume keeps it. Throws InputError that names scene and
// body.
Scene fill_volumes(Scene scene, const EngineTable& engines);
Scene fill_volumes(Scene scene);  // with the standard engines

// The same for one body, whatever its model needs, without what the model adds to the specification. On trial there is
// no report on its tetrahedra. For its form alone they are relaxed near the border of what is held only, which decides
// on those that are held.
enum class Filling { whole, on_trial, form };
void fill_volume(BodySpec& body, Filling filling = Filling::whole);

}  // namespace sectio
