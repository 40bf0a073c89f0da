// How far a model is from the truth, by what is done to the body and by how finely it is divided:
//
//   error = sqrt((c n^-p)^2 + floor^2),   n: cells across what matters for the load (Load)
//
// c, p and floor are fitted to the chart's own measurements (docs/chart.csv), one law a load and a method; `ninja
// renew_error_laws` writes them anew into fitted_laws.inc. Relative errors of the whole: mesh, model, driver and step.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace sectio::planning {

// With what n counts.
enum class Load {
  bending,      // cells across the thickness
  twisting,     // the same, and across the width
  indentation,  // cells along the width of the contact, 2 a
  opening,      // cells along the depth of the cut
};
constexpr int kLoads = 4;

// A model with its driver, as the laws tell them apart.
enum class Method {
  surface_springs,       // M1
  tetra_springs,         // M2
  neo_hookean,           // M3, explicit
  neo_hookean_implicit,  // M3
  lattice,               // M4, the body's faces lie on those of its cells
  lattice_beside_faces,  // M4, they don't
};
constexpr int kMethods = 6;

const char* to_string(Load load);
const char* to_string(Method method);

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

// Rows of the chart's table that a scene can get, with n counted as Load says. Other rows, and those that failed or
// moved nothing (error 1 or more, but in twisting), are passed over. Throws InputError when a column is missing.
std::vector<MeasuredError> read_chart(const std::string& csv);
// One law for each load and method that has three points or more: least sum of the logarithms' distances.
// Deterministic.
std::vector<FittedLaw> fit_laws(std::span<const MeasuredError> points);
// As the text of fitted_laws.inc.
std::string to_text(std::span<const FittedLaw> laws);

// What the tree holds. Nothing: the method makes no claim on the load.
std::optional<ErrorLaw> law_for(Load load, Method method);

// What the laws were measured with; another material or form changes the error, see relative_error().
struct LoadCase {
  Load load = Load::bending;
  double width_m = 0;  // that n counts cells along
  double poisson = 0.45;
  double chi = 0.2236;      // of an indentation: a over the thickness of what is beneath
  double bed_ratio = 1;     // of an indentation: the bed's radius (foundation_radius_m) over a
  double overhang_m = 0;    // of bending: from where what is held ends inside the tissue; 0: it is held at its end
  bool sharp_edges = true;  // the chart's bodies are boxes: tetrahedra bevel their edges
  bool fills_cells = true;  // of hexahedra: none is part empty
};
// Nothing when the method makes no claim.
std::optional<double> relative_error(const LoadCase& load, Method method, double cell_m);

// Of a ball on a layer bonded to its ground against a ball on a half-space with Poisson's ratio 0 (Dimitriadis 2002).
double layer_stiffness(double poisson, double chi);

}  // namespace sectio::planning
