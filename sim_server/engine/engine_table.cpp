#include "sim_server/engine/engine_table.h"

#include <algorithm>
#include <utility>

#include "common/core/error.h"

namespace sectio {

void BodyEngines::follow(const SharedBody& body, const TopologyChange& change, const CutTicket* planned) {
  planned ? cutting->accept(body, *planned) : cutting->follow(body, change);  // a volume gives new vertices their state
  deformation->follow(body, change);
  collision->follow(body, change);
  splitting->follow(body, change);
  for (const auto& process : processes) process->follow(body, change);
}

void BodyEngines::publish(const SharedBody& body, std::vector<ScalarField>& fields) const {
  for (const Engine* engine : all()) engine->publish(body, fields);
}

std::vector<Engine*> BodyEngines::all() const {
  std::vector<Engine*> engines{deformation.get(), cutting.get(), splitting.get(), collision.get()};
  for (const auto& process : processes) engines.push_back(process.get());
  return engines;
}

const ModelEntry* EngineTable::find_model(const std::string& name) const {
  const auto found = std::ranges::find(models, name, [](const ModelEntry& m) { return m.traits.name; });
  return found != models.end() ? &*found : nullptr;
}

const ModelEntry& EngineTable::model(const std::string& name) const {
  const ModelEntry* found = find_model(name);
  SECTIO_ASSERT(found, "the table has this model");
  return *found;
}

ModelEntry& EngineTable::model(const std::string& name) {
  return const_cast<ModelEntry&>(std::as_const(*this).model(name));
}

const ProcessEntry* EngineTable::find_process(const std::string& kind) const {
  const auto found = std::ranges::find(processes, kind, [](const ProcessEntry& p) { return p.traits.kind; });
  return found != processes.end() ? &*found : nullptr;
}

std::vector<planning::Method> EngineTable::methods() const {
  std::vector<planning::Method> methods;
  for (const ModelEntry& entry : models)
    for (const planning::Method& method : entry.methods) {
      methods.push_back(method);
      methods.back().model = entry.traits.name;
    }
  return methods;
}

EngineTraits EngineTable::traits() const {
  EngineTraits traits;
  for (const ModelEntry& entry : models) traits.models.push_back(entry.traits);
  for (const ProcessEntry& entry : processes) traits.processes.push_back(entry.traits);
  return traits;
}

}  // namespace sectio
