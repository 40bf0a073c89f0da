#include "sim_server/net/world_view.h"

#include "sim_server/scene/scene_outcome.h"

namespace sectio {

void view_world(const Simulation& simulation, std::size_t tools, WorldView& view) {
  view.bodies.resize(simulation.body_count());
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b)
    view.bodies[b] = {&simulation.mesh(b), simulation.positions_world_m(b)};
  view.scalars = [&simulation](std::uint32_t body_id) { return simulation.scalars(body_id); };
  view.tool_poses_world.resize(tools);
  for (std::uint32_t t = 0; t < tools; ++t) view.tool_poses_world[t] = simulation.tool_pose_world(t);
}

namespace {

BodyInfo info_of(const BodySpec& body) {
  return {body.name, body.skin_colour, body.wall_colour, body.regions, body.surface, body.layers};
}

}  // namespace

SceneInfo scene_info(const Scene& scene) {
  SceneInfo info;
  info.session = scene.session;
  info.step_s = scene.step_s;
  info.camera = scene.camera;
  info.floor_z_m = scene.floor_z_m;
  info.world_bodies = scene.world_bodies;
  for (const BodySpec& body : scene.bodies) info.bodies.push_back(info_of(body));
  for (const ToolSpec& tool : scene.tools) {
    const ToolGeometry& g = tool.geometry;
    info.tools.push_back({tool.name, tool.kind, {g.a_tool_m, g.b_tool_m, g.c_tool_m, g.d_tool_m}, g.gauge_m});
  }
  if (scene.exercise) info.task = task_in_words(scene.exercise->task, scene.expect);
  return info;
}

SceneInfo scene_info_now(const Scene& scene, const Simulation& simulation) {
  SceneInfo info = scene_info(scene);
  for (auto b = static_cast<std::uint32_t>(info.bodies.size()); b < simulation.body_count(); ++b)
    info.bodies.push_back(info_of(simulation.body(b)));
  return info;
}

std::vector<TriangleMesh> meshes_of(const Simulation& simulation) {
  std::vector<TriangleMesh> meshes;
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i) meshes.push_back(simulation.mesh(i));
  return meshes;
}

}  // namespace sectio
