// Long steps of the implicit driver: bars that are let go under their own weight, explicitly and in implicit steps of
// 1, 16.7 and 33 ms. One line a run: the processor's time for a simulated second and for a step, iterations of Newton's
// method and products with the Hessian in a step, what is left over, and how far down the tip gets. Then what the parts
// of a step cost. The last lines are ratios within the run. `bench long_steps 2` does the two smaller bars only.
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "common/core/formatted.h"
#include "sim_server/deformation/rigid_aggregates.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "tests/bench/bench.h"
#include "tests/support/tet_shapes.h"

namespace sectio::long_steps_bench {
namespace {

double processor_time_s() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Bar {
  int along, across;
  double duration_s;
};
struct Run {
  double per_second = 0, step_ms = 0, newton = 0, products = 0, mean_residual = 0, most_residual = 0, tip_m = 0;
  std::uint64_t not_met = 0;
};

TetMesh mesh_of(const Bar& bar) {
  return test::tet_box(bar.along, bar.across, bar.across, Vec3(0.2, 0.05, 0.05), test::BoxLattice::kuhn);
}
TetSolid solid_of(const TetMesh& mesh, double step_s, VolumeIntegrator integrator) {
  VolumeMaterial material;
  material.young_pa = 1e5;
  material.poisson = 0.4;
  VolumeSettings settings;
  settings.step_s = step_s;
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.x() < 1e-9);
  return {mesh, material, settings, integrator};
}

// The best of several calls, ms.
template <class Do>
double best_ms(const Do& run) {
  double best = 1e9;
  for (int n = 0; n < 12; ++n) {
    const double start = processor_time_s();
    run(n);
    best = std::min(best, 1000 * (processor_time_s() - start));
  }
  return best;
}

void print_parts(const Bar& bar) {
  const TetMesh mesh = mesh_of(bar);
  TetSolid solid = solid_of(mesh, 1.0 / 60, VolumeIntegrator::implicit_only);
  TetEnergy& energy = solid.energy();
  std::vector<Vec3> x = mesh.vertices_body_m, force(x.size(), Vec3::Zero());
  std::vector<Mat3> blocks(x.size(), Mat3::Zero());
  std::vector<Vec4f> p(x.size(), Vec4f(1, 2, 3, 0)), y(x.size(), Vec4f::Zero());
  const auto moved = [&](int n) { x[5].z() += 1e-9 * n; };
  RigidAggregates coarse;
  const double forces = best_ms([&](int n) { moved(n), energy.add_forces(x, force); });
  const double hessian = best_ms([&](int) { energy.linearise(x); });
  const double diagonal = best_ms([&](int) { energy.add_blocks(blocks); });
  const double product = best_ms([&](int) { energy.add_product(p, y); });
  const double divided = best_ms([&](int) { coarse.divide(energy.graph()); });
  const double places = best_ms([&](int) { coarse.begin(x); });
  const double shares = best_ms([&](int) { coarse.begin(x), energy.add_to(coarse); });
  const double factor = best_ms([&](int) { coarse.begin(x), energy.add_to(coarse), coarse.finish(); });
  const double correction = best_ms([&](int) { coarse.add_correction(p, y); });
  const auto count = static_cast<double>(mesh.tetrahedra.size());
  std::printf(
      "%10zu forces %.3f ms, Hessian %.3f, blocks %.3f, product %.4f (%.2f ns a tetrahedron); groups: after a change "
      "%.2f, matrix %.3f, factor %.3f, correction %.4f\n",
      mesh.tetrahedra.size(), forces, hessian, diagonal, product, 1e6 * product / count, divided, shares - places,
      factor - shares, correction);
}

Run run(const Bar& bar, double step_s, VolumeIntegrator integrator) {
  const TetMesh mesh = mesh_of(bar);
  TetSolid solid = solid_of(mesh, step_s, integrator);
  test::Points x = test::at_rest(mesh), v = test::still(x);
  Run r;
  double steps = 0, took_s = 0;
  for (double t = 0; t < bar.duration_s; t += step_s, ++steps) {
    const double start = processor_time_s();
    solid.step(x, v, {}, {});
    took_s += processor_time_s() - start;
    r.newton += solid.driver().iterations();
    r.products += solid.driver().products();
    const double residual = solid.diagnostics().residual;
    r.mean_residual += residual;
    r.most_residual = std::max(r.most_residual, residual);
  }
  r.per_second = took_s / (steps * step_s);
  r.step_ms = 1000 * took_s / steps;
  for (double* sum : {&r.newton, &r.products, &r.mean_residual}) *sum /= steps;
  r.not_met = solid.diagnostics().steps_not_met;
  for (VertexId n = 0; n < x.size(); ++n) r.tip_m = std::min(r.tip_m, double{x[n].z()});
  return r;
}

const bench::Subject subject("long_steps", [](int argc, char** argv) {
  const std::vector<Bar> bars{{20, 4, 1.5}, {40, 9, 1}, {64, 16, 0.3}};
  const std::size_t count = argc > 1 ? static_cast<std::size_t>(std::atoi(argv[1])) : bars.size();
  std::printf("%10s %8s %10s %9s %7s %8s %9s %9s %8s %9s\n", "tetrahedra", "step ms", "s/s", "ms a step", "Newton",
              "products", "residual", "largest", "not met", "tip m");
  for (const Bar& bar : std::span(bars).first(std::min(count, bars.size()))) {
    const int tetrahedra = 6 * bar.along * bar.across * bar.across;
    const auto print = [&](const char* name, const Run& r) {
      std::printf("%10d %8s %10.4g %9.3f %7.2f %8.1f %9.2g %9.2g %8llu %9.5f\n", tetrahedra, name, r.per_second,
                  r.step_ms, r.newton, r.products, r.mean_residual, r.most_residual,
                  static_cast<unsigned long long>(r.not_met), r.tip_m);
      std::fflush(stdout);
    };
    const Run free = run(bar, 0.001, VolumeIntegrator::automatic);
    print("explicit", free);
    for (const double step_s : {0.001, 1.0 / 60, 1.0 / 30}) {
      const Bar shorter{bar.along, bar.across, step_s < 0.002 ? bar.duration_s / 10 : bar.duration_s};
      const Run r = run(shorter, step_s, VolumeIntegrator::implicit_only);
      print(formatted("%.3g", 1000 * step_s).c_str(), r);
      if (step_s > 0.002)
        std::fprintf(stderr, "%d tetrahedra: steps of %.3g ms cost %.2f of the explicit driver\n", tetrahedra,
                     1000 * step_s, r.per_second / free.per_second);
    }
    print_parts(bar);
  }
  return 0;
});

}  // namespace
}  // namespace sectio::long_steps_bench
