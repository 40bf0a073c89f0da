// Constants of tissues as they were measured, each with the work that it is from (docs/references.md): the one table
// behind `tissue:` of a scene's body and the table in docs/tissue.md.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim_server/scene/scene.h"

namespace sectio {

struct Measured {
  double value;
  const char* work;  // name and year, as in docs/references.md
};

// A constant that nobody has measured is absent. Soft tissue is nearly incompressible: its Poisson's ratio is that of
// MaterialSpec for all.
struct MeasuredTissue {
  const char* name;
  const char* measured_on;
  Measured young_pa;
  std::optional<Measured> density_kg_per_m3 = {};
  std::optional<Measured> damping_per_s = {};
  std::optional<Measured> toughness_j_per_m2 = {};
  std::optional<Measured> friction = {};
};

std::span<const MeasuredTissue> tissues();
std::vector<std::string> tissue_names();

// The usual material with the constants of a tissue, one of tissue_names().
MaterialSpec material_of(const std::string& tissue);

// The table in docs/tissue.md.
std::string tissue_manual();

}  // namespace sectio
