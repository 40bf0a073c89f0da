// The error of a model as a function of the load and of the resolution:
//
//   error = sqrt((c n^-p)^2 + floor^2),   n: number of cells along the length that Load names
//
// c, p and floor of the methods that ship are fitted to what the chart measured (docs/chart.csv), one law for each load
// and method; `ninja renew_error_laws` writes them into fitted_laws.inc. Errors are relative and total: of mesh, model,
// integrator and step.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim_server/planning/method.h"

namespace sectio::planning {

// One measured point of the chart.
struct MeasuredError {
  Load load = Load::bending;
  std::string method;  // its name
  double n = 0, error = 0;
};

struct FittedLaw {
  Load load = Load::bending;
  std::string method;
  ErrorLaw law;
};

// Reads the rows of the chart's table that a scene can use, with n counted as Load says. Skips other rows, and those
// that failed or moved nothing (error 1 or more, except in twisting). Throws InputError when a column is missing.
std::vector<MeasuredError> read_chart(const std::string& csv);
// Fits one law for each load and method that has three points or more, by the least sum of absolute differences of
// logarithms. Deterministic.
std::vector<FittedLaw> fit_laws(std::span<const MeasuredError> points);
// The text of fitted_laws.inc.
std::string to_text(std::span<const FittedLaw> laws);

// The laws in fitted_laws.inc of the method with this name, for those who make a Method.
std::vector<LoadLaw> fitted_laws(std::string_view method);

// A load with its parameters. Defaults are those of the chart; relative_error() corrects for others, but by weight only
// roughly: there it says what to try first (plan.h).
struct LoadCase {
  Load load = Load::bending;
  double width_m = 0;  // length along which n counts cells
  double poisson = 0.45;
  double chi = 0.2236;      // indentation: a over the thickness of the tissue beneath
  double bed_ratio = 1;     // indentation: foundation_radius_m over a
  bool sharp_edges = true;  // the chart's bodies are boxes, whose edges tetrahedra bevel
  bool fills_cells = true;  // hexahedra: no cell is partly empty
  // How much a load by weight matters, up to 1. The error is relative to what the weight moves, or to a fixed
  // share of the thickness where it moves less.
  double share = 1;
};
// Nothing if there is no law.
std::optional<double> relative_error(const LoadCase& load, const Method& method, double cell_m);

// The error by weight with cells of one size over that with cells of another: a power, whatever the law's factor is.
double finer(const Method& method, double from_cell_m, double to_cell_m);

// The stiffness of a ball on a layer bonded to its ground over that of a ball on a half-space with Poisson's ratio 0
// (Dimitriadis et al. 2002).
double layer_stiffness(double poisson, double chi);

}  // namespace sectio::planning
