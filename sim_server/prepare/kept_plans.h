// Plans that an earlier run has made on this machine, in files beside the calibration.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim_server/planning/plan.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// The choice for one body.
struct KeptChoice {
  std::string method;  // its name
  double step_s = 0, cell_m = 0, tetrahedra = 0;
  double error = 0, cpu = 0, cut_cpu = 0, cut_step_s = 0;
};
struct KeptPlan {
  std::string table;
  std::vector<KeptChoice> choices;  // for the bodies that are auto, in order
};

// A number that differs when anything differs on which a plan depends: the bodies with their meshes, the instruments
// with their traces, gravity and step, the methods with their laws, the calibration, and the program.
std::uint64_t plan_key(const Scene& scene, std::span<const planning::Method> methods, const std::string& calibration);

// The files are in $XDG_CACHE_HOME/sectio/plans, else in ~/.cache/sectio/plans. One that can't be read is told in one
// line of the log, and is no plan; one that can't be written is no error.
std::optional<KeptPlan> kept_plan(std::uint64_t key);
void keep_plan(std::uint64_t key, const KeptPlan& plan);

// The text of a file, and its reader: nothing when the text is torn or of another plan.
std::string to_text(const KeptPlan& plan, std::uint64_t key);
std::optional<KeptPlan> plan_from(const std::string& text, std::uint64_t key);

}  // namespace sectio
