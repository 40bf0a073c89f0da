// One stroke's cut, begun where it is known to begin, in volumes of a thousand to a million tetrahedra of one size:
// time for each tetrahedron that it crosses. The last lines give the growth.
#include <cstdio>
#include <map>
#include <string>

#include "sim_server/volume/tets/tet_cut.h"
#include "tests/bench/bench.h"
#include "tests/support/tet_shapes.h"

namespace sectio::tet_cut_bench {
namespace {

constexpr double kCell = 0.005;

struct Place {
  TetTopology volume;
  CutSheet sheet;
  std::uint32_t begin;
};

// A rectangle of five cells by five, in the middle of a block.
Place place(std::int64_t cubes) {
  const int n = static_cast<int>(cubes);
  const TetMesh mesh = test::tet_box(n, n, n, Vec3::Constant(n * kCell));
  Place p{TetTopology(mesh), {}, 0};
  const Vec3 at = Vec3::Constant(0.5 * n * kCell) + Vec3(0.3, 0.41, 0.37) * kCell;
  const Vec3 u = 2.5 * kCell * Vec3(1, 0.1, 0.2), w = 2.5 * kCell * Vec3(-0.1, 1, 0.3);
  p.sheet.outline_rest_m = {at - u - w, at + u - w, at + u + w, at - u + w};
  double closest = 1;
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (const VertexId v : mesh.tetrahedra[t]) middle += 0.25 * mesh.vertices_body_m[v];
    if ((middle - at).norm() < closest) closest = (middle - at).norm(), p.begin = t;
  }
  return p;
}

void cut_volume(benchmark::State& state) {
  Place p = place(state.range(0));
  std::uint32_t crossed = 0;
  for (auto _ : state) {
    const TetCutOutcome outcome = cut(p.volume, p.sheet, {}, std::array{p.begin});
    crossed = outcome.crossed;
    state.PauseTiming();
    p.volume.undo_to(0);
    state.ResumeTiming();
  }
  state.counters["tetrahedra"] = static_cast<double>(p.volume.tetrahedra().size());
  state.counters["crossed"] = crossed;
  state.counters["us_per_crossed"] =
      benchmark::Counter(1e-6 * crossed, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void print_ratios(const bench::BestTimes& best) {
  const auto small = best.find("cut_volume/8"), large = best.find("cut_volume/58");
  if (small == best.end() || large == best.end()) return;
  std::fprintf(stderr, "a cut in a million tetrahedra takes %.2f times as long as in 2560\n",
               large->second / small->second);
}

const bench::Subject subject("tet_cut", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("cut_volume", cut_volume)->Arg(8)->Arg(16)->Arg(32)->Arg(58);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::tet_cut_bench
