// The engines of a body, and the table of all engines that a scene can name: a `model` of a body, a `kind` of a process
// in a body or between bodies, each with the keys of its own that a scene may give. The entries that ship are in
// engine/standard_engines.cpp; a program can add entries, or exchange some:
//
//   EngineTable table = standard_engines();
//   table.models.push_back({{.name = "my_model", .needs_volume = true, .keys = {...}}, [](const EngineSite& site) {
//     BodyEngines engines = surface_spring_engines(site);
//     engines.deformation = std::make_unique<MyIntegrator>(site.body, site.spec.options.number("stiffness_pa"));
//     return engines;
//   }});
//   const Scene scene = prepared(load_scene(path, table.traits()), table);
//   Simulation simulation(scene, table);
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim_server/collision/collision_engine.h"
#include "sim_server/components/splitting_engine.h"
#include "sim_server/deformation/deformation_engine.h"
#include "sim_server/engine/world_engine.h"
#include "sim_server/planning/method.h"
#include "sim_server/scene/scene.h"
#include "sim_server/surface/cutting/cutting_engine.h"

namespace sectio {

struct EngineSite;
struct BodyEngines;
using MakeEngines = std::function<BodyEngines(const EngineSite&)>;

// The engines of one body. Engines that share data of their own (tetrahedra that one moves and another cuts) are made
// together.
struct BodyEngines {
  std::unique_ptr<CollisionEngine> collision;
  std::unique_ptr<CuttingEngine> cutting;
  std::unique_ptr<SplittingEngine> splitting;
  std::unique_ptr<DeformationEngine> deformation;
  std::vector<std::unique_ptr<ProcessEngine>> processes;  // in the order of their steps
  // Makes the engines of a part that comes off this body, for a factory whose engines share data with their parts.
  MakeEngines make_part;

  // `planned`: the ticket of the cutting engine's plan, if that planned the change.
  void follow(const SharedBody& body, const TopologyChange& change, const CutTicket* planned = nullptr);
  void publish(const SharedBody& body, std::vector<ScalarField>& fields) const;
  std::vector<Engine*> all() const;  // in the order in which they publish
};

// The body that engines are made for.
struct EngineSite {
  const BodySpec& spec;
  const Scene& scene;
  SharedBody body;
  Pose frame_world;  // the shape at rest
  bool is_part = false;
  bool is_rigid = false;  // a part that moves as a whole: it gets its deformation engine, whatever the factory makes
  // For a part: the engines and the state of the body that it came off, which still know it, and by vertex of the part
  // its slot there. None for a part whose engines are about to read their state.
  const BodyEngines* parent = nullptr;
  const ParticleState* parent_particles = nullptr;
  std::span<const VertexId> vertex_from = {};
};

struct ModelEntry {
  ModelTraits traits;  // its needs and abilities, and its own keys in a scene
  MakeEngines make;
  // Once its volume is filled: completes the specification, and notes what a person should know. May be empty.
  std::function<void(BodySpec&)> prepare = {};
  // The ways to run it from which `model: auto` chooses; none: it is never chosen.
  std::vector<planning::Method> methods = {};
};

// The body that a process is made for, one of those that the scene names.
struct ProcessSite {
  const ProcessSpec& spec;
  const Scene& scene;
  SharedBody body;
  Pose frame_world;  // the shape at rest
  // For a part: the process in the body that it came off, and by vertex of the part its slot there. None for a part
  // whose process is about to read its state.
  const ProcessEngine* parent = nullptr;
  std::span<const VertexId> vertex_from = {};
};
using MakeProcess = std::function<std::unique_ptr<ProcessEngine>(const ProcessSite&)>;

// All the bodies that a process between bodies is between, in the order in which the scene names them.
struct WorldEngineSite {
  const ProcessSpec& spec;
  const Scene& scene;
  std::span<const SharedBody> bodies;
};
using MakeWorldEngine = std::function<std::unique_ptr<WorldEngine>(const WorldEngineSite&)>;

// Exactly one of the two functions is set.
struct ProcessEntry {
  ProcessTraits traits;
  MakeProcess in_body;      // one for each body
  MakeWorldEngine between;  // one for all of them
};

struct EngineTable {
  std::vector<ModelEntry> models;  // in the order in which documents list them
  std::vector<ProcessEntry> processes;

  // The row with this name (BodySpec::model); nullptr if there is none.
  const ModelEntry* find_model(const std::string& name) const;
  ModelEntry& model(const std::string& name);  // there must be one of this name
  const ModelEntry& model(const std::string& name) const;
  // The row of this kind (ProcessSpec::kind); nullptr if there is none.
  const ProcessEntry* find_process(const std::string& kind) const;

  EngineTraits traits() const;                    // for the reader of scenes
  std::vector<planning::Method> methods() const;  // methods of all models, for plans
};

}  // namespace sectio
