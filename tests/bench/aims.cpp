// The share of one core that bodies of the project's sizes take in real time: 10 000 vertices of surface springs
// and 25 000 springs of a volume at 1 kHz, and 8000 lattice hexahedra. Each is as stiff as soft tissue, its step of 1
// ms stable or divided into parts that are; whatever the simulation does around the model is not in it. The last lines
// give the fractions.
#include <cstdio>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/bench/bench.h"
#include "tests/support/shapes.h"
#include "tests/support/tet_shapes.h"

namespace sectio::aims_bench {
namespace {

constexpr double kStep_s = 0.001;

// 10 242 vertices, 0.12 m long.
void surface_springs(benchmark::State& state) {
  const TriangleMesh mesh(test::ellipsoid(5, Vec3(0.06, 0.05, 0.04)));
  SurfaceSpringSettings settings;
  settings.step_s = kStep_s;
  SurfaceSprings model(mesh, {}, {}, settings);
  if (model.largest_stable_step_s() < kStep_s) return state.SkipWithError("1 ms is not stable");
  test::Points x;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    x.push_back(Vec4f::Zero());
    x.back().head<3>() = mesh.rest_body_m(v).cast<float>();
  }
  test::Points v = test::still(x);
  for (auto _ : state) model.step(x, v);
  state.counters["vertices"] = static_cast<double>(mesh.vertex_slots());
}

template <class Model>
void run(benchmark::State& state, const TetMesh& mesh, Model& model, const char* unit, std::size_t count) {
  test::Points x = test::at_rest(mesh), v = test::still(x);
  for (auto _ : state) model.step(x, v, {}, {});
  state.counters[unit] = static_cast<double>(count);
  state.counters["parts"] = model.substeps();
}

void springs(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  const TetMesh mesh = test::tet_box(n, n, n, Vec3::Constant(0.1));
  VolumeSettings settings;
  settings.step_s = kStep_s;
  TetSprings model(mesh, {}, settings);
  run(state, mesh, model, "springs", model.springs().size());
}

void hexahedra(benchmark::State& state) {
  const TetMesh mesh = test::tet_box(8, 8, 8, Vec3::Constant(0.1));
  VolumeSettings settings;
  settings.step_s = kStep_s;
  HexSolid model(mesh, grid_around(mesh, 0.1 / static_cast<double>(state.range(0))), {}, settings);
  run(state, mesh, model, "hexahedra", model.lattice().cells.size());
}

void print_fractions(const bench::BestTimes& best) {
  for (const auto& [name, us] : best)
    std::fprintf(stderr, "%s: %.3f of one core in real time\n", name.c_str(), 1e-6 * us / kStep_s);
}

const bench::Subject subject("aims", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("surface_springs", surface_springs)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("springs", springs)->Arg(9)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("hexahedra", hexahedra)->Arg(20)->Unit(benchmark::kMicrosecond);
  return bench::run(argc, argv, print_fractions);
});

}  // namespace
}  // namespace sectio::aims_bench
