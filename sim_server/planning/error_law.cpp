#include "sim_server/planning/error_law.h"

#include <cmath>

namespace sectio::planning {
namespace {

constexpr double kChartPoisson = 0.45, kChartChi = 0.2236;  // those of the chart's scenes
constexpr double kSpringsPoisson = 0.25;

// With fewer cells a model doesn't see the load, as a ball falls between the vertices, or the chart doesn't say.
constexpr double kFewestCells[kLoads] = {1.9, 1.4, 0.85, 1.4, 1.9};
// The factor for partly empty cells at the far end of a box's longer sides.
constexpr double kLeftOver = 1.4;

// The factor for bodies without sharp edges. Most of the bending error of a box is due to its edges, which the mesher
// of tetrahedra bevels.
constexpr double kWithoutEdges = 0.4;
// The fixed part ends at the border of an element, so the overhang is wrong by a part of an element, and the sag grows
// with the fourth power of the overhang.
constexpr double kClamp = 4 * 0.1;
// The same for stout bodies, in which the strain is largest at the clamp; fitted to the organs of
// tests/planning/weight_estimate_test.cpp.
constexpr double kClampOfStout = 0.5;

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

const MethodTraits& traits_of(Method method) {
  static constexpr MethodTraits kTraits[kMethods] = {
      {"surface_springs", "surface_springs", false, false, false},
      {"tetra_springs", "tetra_springs", true, false, false},
      {"neo_hookean", "neo_hookean", true, false, false},
      {"neo_hookean_implicit", "neo_hookean", true, true, false},
      {"lattice", "neo_hookean_lattice", true, false, true},
      {"lattice_beside_faces", "neo_hookean_lattice", true, false, true}};
  return kTraits[static_cast<std::size_t>(method)];
}

double ErrorLaw::at(double n) const {
  return std::hypot(c * std::pow(n, -p), floor);
}

std::optional<ErrorLaw> law_for(Load load, Method method) {
  for (const FittedLaw& fitted : kFitted)
    if (fitted.load == load && fitted.method == method) return fitted.law;
  return std::nullopt;
}

double layer_stiffness(double nu, double chi) {
  const double a = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1 - nu);
  const double b = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1 - nu);
  const double s = chi / M_PI, a2 = a * a, pi2 = M_PI * M_PI;
  return (1 - 2 * a * s + 4 * a2 * s * s - 8 * (a * a2 + 4 * pi2 * b / 15) * s * s * s +
          16 * a * (a * a2 + 3 * pi2 * b / 5) * s * s * s * s) /
         (1 - nu * nu);
}

// Springs have a Poisson's ratio of their own. The chart measured by how much they are too stiff in twisting and too
// soft under a ball; for another Poisson's ratio of the tissue, this changes with the tissue's own stiffness.
namespace {

std::optional<double> error_of_full_load(const LoadCase& load, Method method, double cell_m) {
  // Cells that are partly empty at the far end of a box lie beside its faces there.
  const bool is_beside = load.load == Load::hanging && method == Method::lattice && !load.fills_cells;
  const std::optional<ErrorLaw> law = law_for(load.load, is_beside ? Method::lattice_beside_faces : method);
  if (!law) return std::nullopt;
  const double n = load.width_m / cell_m;
  if (n < kFewestCells[static_cast<std::size_t>(load.load)]) return std::max(1.0, law->at(n));
  const bool is_solid = method == Method::neo_hookean || method == Method::neo_hookean_implicit;
  const double edges = load.load == Load::bending && is_solid && !load.sharp_edges ? kWithoutEdges : 1;
  const double clamp = load.load == Load::hanging ? kClampOfStout : kClamp;
  const double error = std::hypot(edges * law->at(n), load.overhang_m > 0 ? clamp * cell_m / load.overhang_m : 0);
  if (load.load == Load::indentation && method == Method::surface_springs) {
    const double chart = layer_stiffness(kChartPoisson, kChartChi) * (1 - kChartPoisson * kChartPoisson);
    const double here = layer_stiffness(load.poisson, load.chi) * (1 - load.poisson * load.poisson);
    return std::hypot(error, chart / here - 1, 1 / load.bed_ratio - 1);
  }
  // The bending error of hexahedra is at the clamp, where tissue can't contract; it is proportional to Poisson's ratio.
  if (load.load == Load::bending && method == Method::lattice)
    return std::max(error * load.poisson / kChartPoisson, law->floor) * (load.fills_cells ? 1 : kLeftOver);
  if (method != Method::tetra_springs) return error;
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

}  // namespace

std::optional<double> relative_error(const LoadCase& load, Method method, double cell_m) {
  // The homes of surface springs hold the weight: it moves nothing.
  const bool stays = method == Method::surface_springs && (load.load == Load::hanging || load.share < 1);
  const std::optional<double> error = stays ? 1 : error_of_full_load(load, method, cell_m);
  if (!error) return std::nullopt;
  return load.share * *error;
}

}  // namespace sectio::planning
