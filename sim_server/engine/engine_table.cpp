#include "sim_server/engine/engine_table.h"

namespace sectio {

void BodyEngines::follow(const SharedBody& body, const TopologyChange& change) {
  deformation->follow(body, change);
  collision->follow(body, change);
  cutting->follow(body, change);
  splitting->follow(body, change);
  for (const auto& process : processes) process->follow(body, change);
}

}  // namespace sectio
