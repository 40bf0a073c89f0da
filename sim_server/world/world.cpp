#include "sim_server/world/world.h"

#include <utility>

#include "common/core/error.h"

namespace sectio {

World::World(const Scene& s, const EngineTable& engines) : scene(s), gravity(scene) {
  for (std::uint32_t i = 0; i < scene.bodies.size(); ++i) {
    const auto make = engines.models.find(scene.bodies[i].model);
    if (make == engines.models.end())
      throw InputError(scene.file + ": bodies[" + std::to_string(i) + "].model: there are no engines for " +
                       scene.bodies[i].model);
    bodies.push_back(std::make_unique<Body>(scene.bodies[i], scene, i, make->second));
  }
  for (std::uint32_t i = 0; i < scene.tools.size(); ++i) tools.emplace_back(i, scene);
  for (std::uint32_t i = 0; i < scene.tools.size(); ++i)
    for (std::size_t e = 0; e < instrument_of(scene.tools[i].kind).edges; ++e) edges.push_back({i, e});
  for (auto& body : bodies) add_contacts(*body);
  for (const auto& body : bodies) checks.emplace_back(body->spec);
}

void World::add_contacts(Body& body) {
  for (std::uint32_t i = 0; i < edges.size(); ++i)
    contacts.emplace_back(i, scene.tools[edges[i].tool_id], edges[i].index, body, !body.rigid);
}

void World::add_part(std::unique_ptr<Body> part) {
  add_contacts(*part);
  checks.emplace_back(part->spec);
  bodies.push_back(std::move(part));
}

}  // namespace sectio
