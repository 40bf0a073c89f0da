// The error of a model as a function of the load and of the resolution:
//
//   error = sqrt((c n^-p)^2 + floor^2),   n: number of cells along the length that Load names
//
// c, p and floor are fitted to the measurements of the chart (docs/chart.csv), one law for each load and method; `ninja
// renew_error_laws` writes them into fitted_laws.inc. Errors are relative and total: of mesh, model, integrator and
// step.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace sectio::planning {

// The load, and what n counts for it.
enum class Load {
  bending,      // cells across the thickness
  twisting,     // cells across the thickness and the width
  indentation,  // cells along the width of the contact, 2 a
  opening,      // cells along the depth of the cut
  hanging,      // cells across the thickness; also of what stands or lies under its weight
};
constexpr int kLoads = 5;

// A model with its integrator; each has laws of its own.
enum class Method {
  surface_springs,
  tetra_springs,
  neo_hookean,           // explicit
  neo_hookean_implicit,  // the same model, implicit
  lattice,               // neo_hookean_lattice, the body's faces lie on faces of cells
  lattice_beside_faces,  // neo_hookean_lattice, they don't
};
constexpr int kMethods = 6;

const char* to_string(Load load);

// The properties of a method that plans depend on, and its names.
struct MethodTraits {
  const char* name;   // in laws and tables
  const char* model;  // the model of a scene
  bool needs_volume;
  bool is_implicit;
  bool embeds;  // its elements are cells of a lattice, which carry the tetrahedra
};
const MethodTraits& traits_of(Method method);
inline const char* to_string(Method method) {
  return traits_of(method).name;
}

struct ErrorLaw {
  double c = 0, p = 0, floor = 0;
  double at(double n) const;
};

// One measured point of the chart.
struct MeasuredError {
  Load load = Load::bending;
  Method method = Method::neo_hookean;
  double n = 0, error = 0;
};

struct FittedLaw {
  Load load;
  Method method;
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

// The law in fitted_laws.inc. Nothing: there is no law for this load and method.
std::optional<ErrorLaw> law_for(Load load, Method method);

// A load with its parameters. Defaults are those of the chart; relative_error() corrects for others.
struct LoadCase {
  Load load = Load::bending;
  double width_m = 0;  // length along which n counts cells
  double poisson = 0.45;
  double chi = 0.2236;    // indentation: a over the thickness of the tissue beneath
  double bed_ratio = 1;   // indentation: foundation_radius_m over a
  double overhang_m = 0;  // by weight: overhang, where the fixed part ends inside the tissue; 0: it is held at its end
  bool sharp_edges = true;  // the chart's bodies are boxes, whose edges tetrahedra bevel
  bool fills_cells = true;  // hexahedra: no cell is partly empty
  // How much a load by weight matters, up to 1. The error is relative to what the weight moves, or to a fixed
  // share of the thickness where it moves less.
  double share = 1;
};
// Nothing if there is no law.
std::optional<double> relative_error(const LoadCase& load, Method method, double cell_m);

// The stiffness of a ball on a layer bonded to its ground over that of a ball on a half-space with Poisson's ratio 0
// (Dimitriadis et al. 2002).
double layer_stiffness(double poisson, double chi);

}  // namespace sectio::planning
