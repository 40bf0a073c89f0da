// The simulation's world as the wire shows it.
#pragma once

#include "sim_server/net/server_net.h"
#include "sim_server/simulation.h"

namespace sectio {

// Refills `view`, so that a step allocates nothing. The simulation must outlive the view.
void view_world(const Simulation& simulation, std::size_t tools, WorldView& view);

// Names, colours, tools and camera of the scene, without the epoch.
SceneInfo scene_info(const Scene& scene);
// The same, with the parts that have come off the scene's bodies so far.
SceneInfo scene_info_now(const Scene& scene, const Simulation& simulation);

// Copies of all bodies as they are.
std::vector<TriangleMesh> meshes_of(const Simulation& simulation);

}  // namespace sectio
