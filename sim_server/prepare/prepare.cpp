#include "sim_server/prepare/prepare.h"

#include <utility>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/choose_model.h"
#include "sim_server/prepare/fill_volumes.h"

namespace sectio {

Scene prepared(Scene scene, const EngineTable& engines) {
  return fill_volumes(planned(std::move(scene), engines), engines);
}

Scene prepared(Scene scene) {
  return prepared(std::move(scene), standard_engines());
}

}  // namespace sectio
