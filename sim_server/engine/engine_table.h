// The engines of a body, and the table that says which ones a `model` of a scene gets. The entries that ship are in
// engine/standard_engines.cpp; a program can add or exchange entries:
//
//   EngineTable table = standard_engines();
//   table.models["surface_springs"] = [](const EngineSite& site) {
//     BodyEngines engines = surface_spring_engines(site);
//     engines.deformation = std::make_unique<MyIntegrator>(site.body);       // exchanged
//     engines.processes.push_back(std::make_unique<Bleeding>(site));         // added
//     return engines;
//   };
//   Simulation simulation(scene, table);
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim_server/collision/collision_engine.h"
#include "sim_server/components/splitting_engine.h"
#include "sim_server/deformation/deformation_engine.h"
#include "sim_server/scene/scene.h"
#include "sim_server/surface/cutting/cutting_engine.h"

namespace sectio {

// Of one body. Engines that share data of their own (tetrahedra that one moves and another cuts) are made together.
struct BodyEngines {
  std::unique_ptr<CollisionEngine> collision;
  std::unique_ptr<CuttingEngine> cutting;
  std::unique_ptr<SplittingEngine> splitting;
  std::unique_ptr<DeformationEngine> deformation;
  std::vector<std::unique_ptr<ProcessEngine>> processes;  // in the order of their steps

  void follow(const SharedBody& body, const TopologyChange& change);
};

// What engines are made for.
struct EngineSite {
  const BodySpec& spec;
  const Scene& scene;
  SharedBody body;
  Pose frame_world;  // of the shape at rest
  bool is_part = false;
  // Of a part: the engines of the body that it came off, which still know it, and by vertex of the part its slot there.
  const BodyEngines* parent = nullptr;
  std::span<const VertexId> vertex_from = {};
};

using MakeEngines = std::function<BodyEngines(const EngineSite&)>;

struct EngineTable {
  std::map<std::string, MakeEngines> models;  // by BodySpec::model
};

}  // namespace sectio
