// Chooses a model for each body whose scene says `model: auto`.
#pragma once

#include <string>

#include "sim_server/engine/engine_table.h"
#include "sim_server/planning/plan.h"
#include "sim_server/scene/scene.h"

namespace sectio {

struct PlannedScene {
  Scene scene;        // without auto: models, volumes and step chosen, estimates in BodySpec::plan
  std::string table;  // for people, of each body that was auto (planning/plan.h); empty: none was
};

// When a body is auto, measures this machine or reads an earlier measurement (prepare/machine_speed.h), and builds the
// chosen body to see its true size and step. The plan is kept on disk, and read when all on which it depends is as it
// was (prepare/kept_plans.h). `anew`: measures and plans again. Throws InputError that names scene and body.
PlannedScene plan_scene(Scene scene, const EngineTable& engines, bool anew = false);

// The same on a machine of this speed: nothing is measured or kept, so that equal scenes get equal plans.
PlannedScene plan_scene(Scene scene, const EngineTable& engines, const planning::Calibration& speed);

// The scene of plan_scene(); its tables go to the log.
Scene planned(Scene scene, const EngineTable& engines);

}  // namespace sectio
