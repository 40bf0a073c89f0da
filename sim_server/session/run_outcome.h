// Gathers the Outcome of a run (scene/scene_outcome.h), for its report and for what the scene expects.
#pragma once

#include <cstdint>
#include <vector>

#include "sim_server/session/report.h"
#include "sim_server/simulation.h"

namespace sectio {

class RunOutcome {
 public:
  // Before the first step. The simulation must outlive this.
  explicit RunOutcome(const Simulation& simulation);
  // After each step.
  void add(const StepOutput& output);
  // The outcome at this moment; counts and largest values are those of the figures. O(all).
  Outcome finish(const RunFigures& figures) const;

  template <class A>
  void archive(A& a) {
    a(family_of_, parts_begun_);
  }

 private:
  const Simulation& simulation_;
  std::vector<std::uint32_t> family_of_;  // by body: the body of the scene that it is, or came off
  std::vector<std::size_t> parts_begun_;  // by body of the scene: how many components it had
};

}  // namespace sectio
