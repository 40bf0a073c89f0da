// From the simulation's world to what goes on the wire.
#pragma once

#include "sim_server/net/server_net.h"
#include "sim_server/simulation.h"

namespace sectio {

// `view` is refilled, so that a step allocates nothing.
void view_world(const Simulation& simulation, std::size_t tools, WorldView& view);

// Names, colours, tools and camera of the scene, without the epoch.
SceneInfo scene_info(const Scene& scene);

}  // namespace sectio
