// The engines that ship, of which the first body's deformation tells what it does to instruments before anything
// filters it.
#pragma once

#include <memory>

#include "sim_server/engine/standard_engines.h"

namespace sectio::test {

struct RawReactions {
  Vec3 force_n = Vec3::Zero();  // force of the last step on all instruments together
  double worst_friction = 0;    // largest |F_t| / F_n of a constraint in the last step
  std::size_t active = 0, constraints = 0;
};
EngineTable engines_that_tell(std::shared_ptr<RawReactions> to);

}  // namespace sectio::test
