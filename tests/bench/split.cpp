// Does anything come off? Triangles looked at and time for it, on grids of 2 k to 2 M triangles (argument: thousands),
// in the three cases of parts.h: a change that hangs together, one that comes off, one that meets around a slit.
#include <cmath>
#include <map>

#include "sim_server/components/leave.h"
#include "sim_server/components/parts.h"
#include "tests/bench/bench.h"
#include "tests/support/shapes.h"

namespace sectio::split_bench {
namespace {

// A slab of about `thousands` x 1000 triangles, and apart from it a cube of 1200.
const TriangleMesh& slab_and_cube(std::int64_t thousands) {
  static std::map<std::int64_t, TriangleMesh> made;
  const auto known = made.find(thousands);
  if (known != made.end()) return known->second;
  const int n = static_cast<int>(std::lround(std::sqrt(static_cast<double>(thousands) * 1000 / 4)));
  TriangleSoup soup = test::box(n, n, 1, Vec3(1, 1, 0.01));
  const TriangleSoup cube = test::box(10, 10, 10, Vec3(0.1, 0.1, 0.1));
  const auto first = static_cast<VertexId>(soup.vertices_body_m.size());
  for (const Vec3& p : cube.vertices_body_m) soup.vertices_body_m.push_back(p + Vec3(2, 0, 0));
  for (const auto& t : cube.triangles) soup.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return made.emplace(thousands, TriangleMesh(soup)).first->second;
}

void search(benchmark::State& state, std::vector<TriangleId> changed) {
  const TriangleMesh& mesh = slab_and_cube(state.range(0));
  PartSearch found;
  for (auto _ : state) benchmark::DoNotOptimize(found = separated_parts(mesh, changed));
  state.counters["visited"] = static_cast<double>(found.visited);
  state.counters["triangles"] = mesh.triangle_count();
}

// The first square's two triangles and their neighbours in the row, as a cut would leave them.
void hangs_together(benchmark::State& state) {
  const TriangleMesh& mesh = slab_and_cube(state.range(0));
  std::vector<TriangleId> changed{1000};
  for (std::size_t k = 0; changed.size() < 60; ++k)
    for (const TriangleId n : mesh.neighbours(changed[k])) changed.push_back(n);
  search(state, changed);
}
void comes_off(benchmark::State& state) {
  search(state, {0, slab_and_cube(state.range(0)).triangle_count() - 1});
}
void meets_20_squares_away(benchmark::State& state) {
  search(state, {1000, 1040});
}
// The search is compared with labels of all triangles.
void whole_mesh(benchmark::State& state) {
  const TriangleMesh& mesh = slab_and_cube(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(part_at(mesh, 0));
}
void leaves(benchmark::State& state) {
  const TriangleMesh& mesh = slab_and_cube(state.range(0));
  const Part part = part_at(mesh, mesh.triangle_count() - 1);
  for (auto _ : state) benchmark::DoNotOptimize(leave(mesh, part));
}

void sizes(benchmark::internal::Benchmark* b) {
  b->Arg(2)->Arg(20)->Arg(200)->Arg(2000)->Unit(benchmark::kMicrosecond);
}

const bench::Subject subject("split", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("hangs_together", hangs_together)->Apply(sizes);
  benchmark::RegisterBenchmark("comes_off", comes_off)->Apply(sizes);
  benchmark::RegisterBenchmark("meets_20_squares_away", meets_20_squares_away)->Apply(sizes);
  benchmark::RegisterBenchmark("leaves", leaves)->Apply(sizes);
  benchmark::RegisterBenchmark("whole_mesh", whole_mesh)->Apply(sizes);
  return bench::run(argc, argv);
});

}  // namespace
}  // namespace sectio::split_bench
