// The step at which symplectic Euler becomes unstable, measured by running it, and what each model predicts for it.
// Forces and masses are the models' own; their integrators are not used.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {

struct Oscillator {
  Points rest;
  std::vector<double> inverse_mass;  // per kg; 0: held
  std::function<void(const Points&, std::span<Vec3>)> forces_n;
  double predicted_s = 0;  // the model's own estimate of the limit, without the safety that it adds
  double small_m = 1e-5;   // a displacement that is small beside every element
};

// Decades by which a disturbance of the state at rest grows in a step; 0 when it doesn't. Linear, whatever its size:
// K u = (f(rest - s u) - f(rest + s u)) / 2 s with s u small. The run ends once it is 300 times as large.
double growth_decades_per_step(const Oscillator& body, double step_s, int steps = 250);

// Within a percent.
double measured_limit_s(const Oscillator& body, double guess_s);
double measured_limit_s(const Oscillator& body);

// Neither gravity nor damping, free.
VolumeSettings undisturbed(double least_substep_s = 0);
VolumeMaterial undamped(double young_pa, double poisson);

// tetra_springs: omega_i^2 = 2 lambda_max(sum_j k_ij n n^T) / m_i; the model uses 0.8 of it.
Oscillator springs_of(const TetMesh& mesh, const VolumeMaterial& material, double least_substep_s = 0);

TetStiffness stiffness_of(const TetMesh& mesh, const VolumeMaterial& material);
// neo_hookean: power iteration, which is a few percent above the limit; the model uses 0.6 or 0.45 of it.
Oscillator solid_of(const TetMesh& mesh, const VolumeMaterial& material, double least_substep_s = 0);
// And the rigorous bound that mass is added by: the rows of the stiffness matrix, sum_b |K_ib| / m_i.
double row_bound_s(const TetMesh& mesh, const VolumeMaterial& material, std::span<const double> inverse_mass);

// neo_hookean_lattice: the limit of one cell, whatever is cut; the model uses 0.8 of it.
Oscillator lattice_of(const TetMesh& mesh, const VolumeMaterial& material, double cell_m);

// surface_springs: omega_i^2 = (2 lambda_max(sum_j K_ij) + k_h,i) / m_i. Without pretension, which a closed surface
// isn't at rest with.
Oscillator surface_of(double young_pa, double poisson);

// A bar of 0.1 x 0.05 x 0.05 m in cubes of 12.5 mm, a little irregular.
TetMesh bar_for_limits();
constexpr double kCell_m = 0.0125;

enum class Model { surface_springs, tetra_springs, neo_hookean, neo_hookean_lattice };
constexpr Model kModels[] = {Model::surface_springs, Model::tetra_springs, Model::neo_hookean,
                             Model::neo_hookean_lattice};
std::string name_of(Model model);
Oscillator oscillator(Model model, double young_pa, double poisson);

// The bar with a cut across it `sliver` of a cell beyond a layer of vertices, none of them snapped to: next to it are
// tetrahedra that are as thin as that.
TetMesh bar_with_slivers(double sliver);

}  // namespace sectio::test
