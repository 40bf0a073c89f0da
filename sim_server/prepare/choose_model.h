// Model auto: a scene whose bodies all have a model.
#pragma once

#include <string>

#include "sim_server/scene/scene.h"

namespace sectio {

struct PlannedScene {
  Scene scene;        // without auto: models, volumes and step chosen, estimates in BodySpec::plan
  std::string table;  // for people, of each body that was auto (planning/plan.h); empty: none was
};

// Measures this machine, or reads what was measured before (prepare/machine_speed.h), when a body is auto; builds what
// it chooses to see what came out. `anew`: measures again. Throws InputError that names scene and body.
PlannedScene plan_scene(Scene scene, bool anew = false);

// The same with the tables in the log.
Scene planned(Scene scene);

}  // namespace sectio
