// Candidates of a plan, made for trial: their counts, their stable step, and how their weight moves them.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "sim_server/engine/engine_table.h"
#include "sim_server/planning/plan.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/prepare/weighed_body.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// The body alone in its scene, with the model of a candidate.
Scene alone(const BodySpec& body, const Scene& scene, const planning::Candidate& candidate);

struct OnTrial {
  BodySpec body;
  planning::BodyShape shape;
  std::optional<Vec3> gravity_body_m_per_s2;  // nothing: it isn't held, or weighs nothing
};

// Remembers all that it has made. A candidate with many elements is made with fewer; its counts, and its error by
// weight, go by powers of their number.
class Trials {
 public:
  // Both must outlive this.
  Trials(const Scene& scene, const EngineTable& engines) : scene_(scene), engines_(engines) {}
  planning::Built of(const OnTrial& subject, const planning::Candidate& candidate);

 private:
  struct Made {
    ModelSize size;
    double surface_vertices = 0, cell_m = 0, added_mass = 0;
    std::optional<double> weighed;
  };
  Made made(const OnTrial& subject, const planning::Candidate& candidate);
  Scene filled(const BodySpec& body, const planning::Candidate& candidate);
  const WeighedBody& weighed(const OnTrial& subject);

  const Scene& scene_;
  const EngineTable& engines_;
  std::map<std::tuple<std::string, const planning::Method*, double, double>, Made> known_;
  std::map<std::tuple<std::string, double, Filling>, BodySpec> volumes_;  // methods share them
  std::map<std::string, WeighedBody> weighed_;
};

}  // namespace sectio
