#include "tests/support/scene_engines.h"

#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/surface/surface_engines.h"

namespace sectio::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"(session: own_engines
step_s: 0.001
duration_s: 1
bodies:
  - name: upper
    mesh: {file: cube.obj, unit: cm}
    pose: {position_world_m: [0, 0, 0.05]}
    model: clay
    creep_per_s: 5
    cutting: {threshold_displacement_m: 0.002}
    volume: {tetrahedra: 200}
  - name: lower
    mesh: {file: cube.obj, unit: cm}
    model: surface_springs
tools:
  - {name: blade, kind: scalpel}
processes:
  - {name: warm, kind: warmth, bodies: [lower], warms_k_per_s: 2}
  - {name: drip, kind: leak, bodies: [upper, lower], water_ml: 1.5}
)";

}  // namespace

EngineTable table_with_own_engines() {
  EngineTable table = standard_engines();
  table.models.push_back({{.name = "clay",
                           .meaning = "Keeps the form that instruments give it, and creeps home.",
                           .needs_volume = true,
                           .keys = {{.name = "creep_per_s",
                                     .meaning = "Share of the way home in a second.",
                                     .range = above(0),
                                     .required = true}}},
                          [](const EngineSite& site) {
                            BodyEngines engines = surface_spring_engines(site);
                            engines.cutting = std::make_unique<Pricking>();
                            engines.deformation =
                                std::make_unique<Clay>(site.spec.tets, site.frame_world, site.spec.material,
                                                       site.spec.options.number("creep_per_s"), site.scene.step_s);
                            return engines;
                          }});
  table.processes.push_back({{.kind = "warmth",
                              .meaning = "Warms a body.",
                              .most_bodies = 8,
                              .keys = {{.name = "warms_k_per_s", .meaning = "How fast.", .default_value = 1.0}}},
                             [](const ProcessSite& site) {
                               return std::make_unique<Warmth>(site.body, site.spec.options.number("warms_k_per_s"));
                             },
                             {}});
  table.processes.push_back({{.kind = "leak",
                              .meaning = "Lets water run from the first body into the second.",
                              .fewest_bodies = 2,
                              .most_bodies = 2,
                              .keys = {{.name = "water_ml", .meaning = "In the first body.", .required = true},
                                       {.name = "flow_ml_per_s", .meaning = "How fast.", .default_value = 2.0}}},
                             {},
                             [](const WorldEngineSite& site) {
                               const Options& o = site.spec.options;
                               return std::make_unique<Leak>(site.bodies, o.number("water_ml"),
                                                             o.number("flow_ml_per_s"));
                             }});
  return table;
}

OwnEnginesScene::OwnEnginesScene() : folder_((fs::temp_directory_path() / "sectio_engines_XXXXXX").string()) {
  if (!mkdtemp(folder_.data())) throw InputError(folder_ + ": can't be made");
  std::ofstream(folder_ + "/cube.obj") << "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nv 0 0 2\nv 2 0 2\nv 0 2 2\nv 2 2 2\n"
                                          "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}
OwnEnginesScene::~OwnEnginesScene() {
  fs::remove_all(folder_);
}

std::string OwnEnginesScene::text() {
  return kScene;
}

Scene OwnEnginesScene::load(const EngineTable& table, const std::string& text) const {
  std::ofstream(folder_ + "/scene.yaml") << text;
  return prepared(load_scene(folder_ + "/scene.yaml", table.traits()), table);
}

}  // namespace sectio::test
