#include "sim_server/planning/error_law.h"

#include <algorithm>
#include <cmath>

namespace sectio::planning {
namespace {

constexpr double kChartPoisson = 0.45, kChartChi = 0.2236;  // the chart's scenes have these
constexpr double kSpringsPoisson = 0.25;

// With fewer cells a model doesn't see the load, as a ball falls between the vertices, or the chart doesn't say.
constexpr double kFewestCells[kLoads] = {1.9, 1.4, 0.85, 1.4, 1.9};
// The factor for partly empty cells at the far end of a box's longer sides.
constexpr double kLeftOver = 1.1;

// The factor for bodies without sharp edges. Most of the bending error of a box is due to its edges, which the mesher
// of tetrahedra bevels.
constexpr double kWithoutEdges = 0.4;

// At the rim of what is held stresses grow like r^(q - 1), q about 0.75 beside nearly incompressible tissue:
// whatever the elements, displacements converge with the power 2 q.
constexpr double kRim = 1.5;

const std::initializer_list<FittedLaw> kFitted = {
#include "sim_server/planning/fitted_laws.inc"
};

}  // namespace

const char* to_string(Load load) {
  switch (load) {
    case Load::bending:
      return "bending";
    case Load::twisting:
      return "twisting";
    case Load::indentation:
      return "indentation";
    case Load::opening:
      return "opening";
    case Load::hanging:
      return "hanging";
  }
  return "";
}

std::vector<LoadLaw> fitted_laws(std::string_view method) {
  std::vector<LoadLaw> laws;
  for (const FittedLaw& fitted : kFitted)
    if (fitted.method == method) laws.push_back({fitted.load, fitted.law});
  return laws;
}

double layer_stiffness(double nu, double chi) {
  const double a = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1 - nu);
  const double b = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1 - nu);
  const double s = chi / M_PI, a2 = a * a, pi2 = M_PI * M_PI;
  return (1 - 2 * a * s + 4 * a2 * s * s - 8 * (a * a2 + 4 * pi2 * b / 15) * s * s * s +
          16 * a * (a * a2 + 3 * pi2 * b / 5) * s * s * s * s) /
         (1 - nu * nu);
}

namespace {

const ErrorLaw* law_for(Load load, const std::vector<LoadLaw>& laws) {
  const auto found = std::ranges::find(laws, load, &LoadLaw::load);
  return found == laws.end() ? nullptr : &found->law;
}

// Springs have a Poisson's ratio of their own. The chart measured by how much they are too stiff in twisting and too
// soft under a ball; for another Poisson's ratio of the tissue, this changes with the tissue's own stiffness.
double error_of_springs(const LoadCase& load, double error) {
  if (load.load == Load::twisting) {
    const double stiffer = (1 + error) * (1 + load.poisson) / (1 + kChartPoisson) - 1;
    return std::max(std::abs(stiffer), error * kSpringsPoisson);
  }
  if (load.load == Load::indentation) {
    const double softer = (1 - std::min(error, 0.95)) * layer_stiffness(kChartPoisson, kChartChi) /
                              layer_stiffness(load.poisson, load.chi) -
                          1;
    return std::max(std::abs(softer), error * kSpringsPoisson);
  }
  return error;
}

std::optional<double> error_of_full_load(const LoadCase& load, const Method& method, double cell_m) {
  const bool is_on_faces = method.elements == Elements::cells_on_faces;
  const bool is_partly_empty = load.load == Load::hanging && is_on_faces && !load.fills_cells;
  const ErrorLaw* law = law_for(load.load, is_partly_empty ? method.laws_of_partly_empty : method.laws);
  if (!law) return std::nullopt;
  const double n = load.width_m / cell_m;
  if (n < kFewestCells[static_cast<std::size_t>(load.load)]) return std::max(1.0, law->at(n));
  const bool is_solid = method.elements == Elements::tetrahedra && !method.is_of_springs;
  const double edges = load.load == Load::bending && is_solid && !load.sharp_edges ? kWithoutEdges : 1;
  double error = edges * law->at(n);
  if (load.load == Load::indentation && method.elements == Elements::surface) {
    const double chart = layer_stiffness(kChartPoisson, kChartChi) * (1 - kChartPoisson * kChartPoisson);
    const double here = layer_stiffness(load.poisson, load.chi) * (1 - load.poisson * load.poisson);
    return std::hypot(error, chart / here - 1, 1 / load.bed_ratio - 1);
  }
  if (load.load == Load::bending && is_on_faces && !load.fills_cells) error *= kLeftOver;
  return method.is_of_springs && method.needs_volume() ? error_of_springs(load, error) : error;
}

}  // namespace

double finer(const Method& method, double from_cell_m, double to_cell_m) {
  const ErrorLaw* law = law_for(Load::hanging, method.laws);
  return std::pow(to_cell_m / from_cell_m, std::min(law ? law->p : kRim, kRim));
}

std::optional<double> relative_error(const LoadCase& load, const Method& method, double cell_m) {
  // The homes of a surface hold the weight: it moves nothing.
  const bool stays = method.elements == Elements::surface && (load.load == Load::hanging || load.share < 1);
  const std::optional<double> error = stays ? 1 : error_of_full_load(load, method, cell_m);
  if (!error) return std::nullopt;
  return load.share * *error;
}

}  // namespace sectio::planning
