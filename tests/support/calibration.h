// The speed of some machine, for plans that must not depend on the one at hand.
#pragma once

#include "sim_server/planning/plan.h"

namespace sectio::test {

inline planning::Calibration calibration() {
  planning::Calibration c;
  c.rate["surface_springs"] = {5, 0, 0};
  c.rate["tetra_springs"] = {7, 4, 0.25};
  c.rate["neo_hookean"] = c.rate["neo_hookean_implicit"] = {10, 14, 0.28};
  c.rate["lattice"] = c.rate["lattice_beside_faces"] = {11, 22, 0.46};
  c.touched_vertex_ns = 5;
  c.cut["surface_springs"] = {16, 35e3, 0, 0, 0, 450};
  c.cut["tetra_springs"] = {15, 160e3, 650e3, 50, 0, 28e3};
  c.cut["neo_hookean"] = {15, 200e3, 550e3, 20, 0, 45e3};
  c.cut["neo_hookean_lattice"] = {13, 500e3, 850e3, 350, 2e3, 20e3};
  return c;
}

}  // namespace sectio::test
