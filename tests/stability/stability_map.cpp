// The limits of explicit steps on grids: over stiffness, over slivers, and over the load on a body; as tables (CSV).
#include <cstdio>
#include <fstream>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "tests/support/explicit_limit.h"
#include "tests/support/violence.h"

namespace sectio {
namespace {

// `n` values from `low` to `high`, each the same multiple of the one before.
std::vector<double> logarithmic(double low, double high, int n) {
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(low * std::pow(high / low, double(i) / (n - 1)));
  return values;
}

std::ofstream table(const std::string& path, const std::string& header) {
  std::ofstream out(path);
  if (!out) throw InputError(path + ": can't be written");
  out << header << "\n";
  std::printf("%s\n", path.c_str());
  return out;
}

// S2. The step over Young's modulus; the frontier is what the model predicts.
void map_young(const std::string& path, int fine) {
  std::ofstream out = table(path, "model,young_pa,step_s,decades_per_step,predicted_s");
  for (const test::Model model : test::kModels) {
    const test::Oscillator usual = test::oscillator(model, 6000, 0.45);
    std::printf("  %s: the limit is %.2f of the predicted one\n", test::name_of(model).c_str(),
                test::measured_limit_s(usual) / usual.predicted_s);
    for (const double young_pa : logarithmic(1e3, 1e6, 4 * fine)) {
      const test::Oscillator body = test::oscillator(model, young_pa, 0.45);
      for (const double step_s : logarithmic(5e-5, 2e-2, 6 * fine))
        out << test::name_of(model) << "," << young_pa << "," << step_s << ","
            << test::growth_decades_per_step(body, step_s) << "," << body.predicted_s << "\n";
    }
  }
}

// S3. The step over the thickness of the slivers beside a cut, with and without added mass.
void map_slivers(const std::string& path, int fine) {
  std::ofstream out = table(path, "body,sliver,step_s,decades_per_step,predicted_s,added_mass");
  const VolumeMaterial material = test::undamped(6000, 0.45);
  const TetMesh coarse = test::bar_with_slivers(0.5);
  const double part_s = 0.8 * test::row_bound_s(coarse, material, test::solid_of(coarse, material).inverse_mass);
  for (const double sliver : logarithmic(1e-4, 0.5, 4 * fine)) {
    const TetMesh mesh = test::bar_with_slivers(sliver);
    const auto write = [&](const char* name, test::Oscillator body, double added) {
      body.small_m = std::min(body.small_m, 0.1 * sliver * test::kCell_m);
      for (const double step_s : logarithmic(3e-7, 1e-2, 6 * fine))
        out << name << "," << sliver << "," << step_s << "," << test::growth_decades_per_step(body, step_s) << ","
            << body.predicted_s << "," << added << "\n";
    };
    const TetSolid heavy(mesh, material, test::undisturbed(part_s));
    write("tetrahedra", test::solid_of(mesh, material), 0);
    write("tetrahedra with added mass", test::solid_of(mesh, material, part_s),
          heavy.diagnostics().added_mass_fraction);
    write("lattice", test::lattice_of(mesh, material, test::kCell_m), 0);
  }
}

// S4. The share of a load's steps that were divided or taken over, over the load and Poisson's ratio.
void map_loads(const std::string& path, int fine) {
  std::ofstream out = table(path, "model_and_load,share_of_load,poisson,share_of_steps,finite");
  for (const std::string model : {"neo_hookean", "neo_hookean_lattice"})
    for (const test::Load load : test::kLoads)
      for (int i = 1; i <= 2 * fine; ++i)
        for (int k = 0; k <= 2 * fine; ++k) {
          const double share = double(i) / (2 * fine), poisson = 0.25 + 0.245 * k / (2 * fine);
          test::Violence violence(model, poisson);
          violence.load(load, share);
          const test::Outcome outcome = violence.outcome();
          out << model << ": " << test::name_of(load) << "," << share << "," << poisson << ","
              << double(outcome.taken_over + outcome.divided) / outcome.steps << "," << outcome.finite << "\n";
        }
}

int run(int argc, char** argv) {
  std::string directory = ".";
  bool quick = false;
  Arguments arguments("stability_map", "Measures where explicit steps end, over stiffness, slivers and loads.");
  arguments.option("--out", directory, "existing directory for young.csv, slivers.csv and loads.csv");
  arguments.toggle("--quick", quick, "coarse grids");
  if (!arguments.parse(argc, argv)) return 0;
  const int fine = quick ? 3 : 6;
  map_young(directory + "/young.csv", fine);
  map_slivers(directory + "/slivers.csv", fine);
  map_loads(directory + "/loads.csv", fine);
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("stability_map", [&] { return sectio::run(argc, argv); });
}
