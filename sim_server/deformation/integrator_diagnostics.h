// How the time integration of a deformation model fares, for checks and reports.
#pragma once

#include <cmath>
#include <cstdint>

namespace sectio {

struct IntegratorDiagnostics {
  // For the last step: the largest stable step, or substep, over the one taken. Infinite if that was implicit.
  double stability_margin = HUGE_VAL;
  double added_mass_fraction = 0;    // mass added for stability, over that of the tissue
  std::uint64_t implicit_steps = 0;  // steps so far that the explicit integrator gave up
  double residual_m = 0;             // if the last step was implicit: the largest displacement in its last sweep
};

}  // namespace sectio
