// Whether a run was well, and why not: for report.json and for the exit code of the program.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim_server/session/report.h"

namespace sectio {

constexpr int kExitNotOk = 3;  // a run whose report says so

struct RunResult {
  std::string report;                // JSON
  std::vector<std::string> reasons;  // reasons in the report; empty: the run was ok
  int exit_code() const { return reasons.empty() ? 0 : kExitNotOk; }
};

// The longest edge of a surface, when it is half as long again as all of the body was at rest; else 0.
double flung_thread_m(const TriangleMesh& mesh, std::span<const Vec3> positions_m);

// One line each: what isn't finite, closed or manifold; threads that were flung out; bodies that have come through each
// other; bodies that froze; more than 10 % of mass added to a body; more than 1 % of steps that did not converge;
// forces that were capped; cuts that were refused, unless the scene says how many it expects; and, of a run for the
// scene's whole duration, expectations of the scene that it didn't meet. Empty when the run was well.
std::vector<std::string> reasons_against(const RunFigures& figures, const Scene& scene, const Simulation& simulation);

}  // namespace sectio
