// How the time integration of a deformation model fares, for checks and reports.
#pragma once

#include <cmath>
#include <cstdint>

namespace sectio {

// The mass that a body may get for stability, over that of its tissue. Beyond kMuchAddedMass the explicit driver
// divides its step further, which needs less; where that isn't enough, steps go to the implicit driver, which needs
// none.
constexpr double kMuchAddedMass = 0.05;
constexpr double kMostAddedMass = 0.1;
constexpr double kAddedMassGiven = 0.09;  // leaves room for tissue that leaves

struct IntegratorDiagnostics {
  // For the last step: the largest stable step, or substep, over the one taken. Infinite if that was implicit.
  double stability_margin = HUGE_VAL;
  double added_mass_fraction = 0;    // mass added for stability, over that of the tissue
  std::uint64_t implicit_steps = 0;  // steps so far that the explicit integrator gave up
  double residual_m = 0;             // if the last step was implicit: how far its last iteration moved something
  double residual = 0;               // the same by force: what is left over, over the weight
  std::uint64_t steps_not_met = 0;   // implicit steps so far whose residual was above the tolerance
};

// The numbers by which the cost of a step is estimated.
struct ModelSize {
  double elements = 0, vertices = 0;
  int parts = 1;                   // parts of an explicit step
  double part_limit_s = HUGE_VAL;  // the longest explicit part that is stable at rest; infinite: `parts` stays as it is
};

}  // namespace sectio
