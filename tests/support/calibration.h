// The speed of some machine, for plans that must not depend on the one at hand.
#pragma once

#include "sim_server/planning/plan.h"

namespace sectio::test {

inline planning::Calibration calibration() {
  planning::Calibration c;
  c.rate[0] = {5, 0, 0};
  c.rate[1] = {7, 4, 0.25};
  c.rate[2] = c.rate[3] = {10, 14, 0.28};
  c.rate[4] = c.rate[5] = {11, 22, 0.46};
  c.touched_vertex_ns = 5;
  return c;
}

}  // namespace sectio::test
