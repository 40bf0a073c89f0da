// Lattice hexahedra against a plain loop with Eigen over an array of structures, in one run: the same energy, gravity,
// damping and integration. The last lines give the ratios and what it costs to make a lattice.
#include <cstdio>
#include <string>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/bench/bench.h"
#include "tests/support/tet_shapes.h"

namespace sectio::hexa_bench {
namespace {

constexpr double kStep = 1e-4, kSide = 0.1;
const Vec3 kGravity(0, 0, -9.81);

TetMesh cube() {
  return test::tet_box(4, 4, 4, Vec3::Constant(kSide));
}
Grid grid_of(const benchmark::State& state) {
  return grid_around(cube(), kSide / static_cast<double>(state.range(0)));
}

void count(benchmark::State& state, std::size_t n) {
  state.counters["hexahedra"] = static_cast<double>(n);
  state.counters["ns_per_hexahedron"] = benchmark::Counter(
      1e-9 * static_cast<double>(n), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

struct Particle {
  Vec3 x, v, f;
  double m;
};
struct Element {
  std::array<std::uint32_t, 8> nodes;
  double volume;
};

void plain_elements(benchmark::State& state) {
  const Grid grid = grid_of(state);
  const HexLattice lattice = lattice_of(cube(), grid);
  const double mu = 6000 / 2.9, kappa = 10 * mu, h = grid.cell_m;
  std::vector<Particle> particles;
  std::vector<Element> elements;
  for (std::uint32_t n = 0; n < lattice.nodes.size(); ++n)
    particles.push_back({lattice.rest_m(n), Vec3::Zero(), Vec3::Zero(), 0});
  for (const HexCell& cell : lattice.cells) {
    elements.push_back({cell.nodes, cell.fill * h * h * h});
    for (const auto n : cell.nodes) particles[n].m += 1060 * elements.back().volume / 8;
  }
  Eigen::Matrix<double, 8, 3> gradient;   // gradients of the shape functions at the centre
  Eigen::Matrix<double, 8, 4> hourglass;  // signs of the other modes
  for (int c = 0; c < 8; ++c) {
    const double s[3] = {c & 1 ? 1.0 : -1.0, c >> 1 & 1 ? 1.0 : -1.0, c >> 2 & 1 ? 1.0 : -1.0};
    gradient.row(c) << s[0] / (4 * h), s[1] / (4 * h), s[2] / (4 * h);
    hourglass.row(c) << s[0] * s[1], s[1] * s[2], s[2] * s[0], s[0] * s[1] * s[2];
  }
  const Eigen::Vector4d weight(1, 1, 1, 0.5);
  for (auto _ : state) {
    for (Particle& p : particles) p.f = p.m * kGravity - 25 * p.m * p.v;
    for (const Element& e : elements) {
      Eigen::Matrix<double, 3, 8> x;
      for (int c = 0; c < 8; ++c) x.col(c) = particles[e.nodes[static_cast<std::size_t>(c)]].x;
      const Mat3 f = x * gradient;
      Mat3 cofactor;
      cofactor.col(0) = f.col(1).cross(f.col(2));
      cofactor.col(1) = f.col(2).cross(f.col(0));
      cofactor.col(2) = f.col(0).cross(f.col(1));
      const Mat3 stress = mu * f + (kappa * (f.col(0).dot(cofactor.col(0)) - 1) - mu) * cofactor;
      const Eigen::Matrix<double, 3, 4> modes = x * hourglass / 8;
      const Eigen::Matrix<double, 3, 8> force =
          -e.volume * (stress * gradient.transpose() +
                       (mu * kHourglass / (h * h)) * (modes * weight.asDiagonal() * hourglass.transpose()));
      for (int c = 0; c < 8; ++c) particles[e.nodes[static_cast<std::size_t>(c)]].f += force.col(c);
    }
    for (Particle& p : particles) {
      p.v += kStep / p.m * p.f;
      p.x += kStep * p.v;
    }
  }
  count(state, elements.size());
}

// A step of the model, with the vertices that ride on it.
void hexahedra(benchmark::State& state) {
  const TetMesh mesh = cube();
  VolumeSettings settings;
  settings.step_s = kStep;
  HexSolid model(mesh, grid_of(state), {}, settings);
  if (model.substeps() != 1) return state.SkipWithError("the step is not one part");
  std::vector<Vec4f> x = test::at_rest(mesh), v = test::still(x);
  for (auto _ : state) model.step(x, v, {}, {});
  count(state, model.lattice().cells.size());
}

void kernels_of(benchmark::State& state, SimdWidth width) {
  if (width == SimdWidth::sixteen && !has_avx512()) return state.SkipWithError("this processor has no AVX-512");
  const HexLattice lattice = lattice_of(cube(), grid_of(state));
  const double mu = 6000 / 2.9;
  const HexRows rows = rows_of(lattice, {mu, 10 * mu, 1060});
  std::vector<Vec4f> x(lattice.nodes.size(), Vec4f::Zero()), v = x, f = x;
  for (std::uint32_t n = 0; n < x.size(); ++n) x[n].head<3>() = lattice.rest_m(n).cast<float>();
  const std::vector<float> inverse(x.size(), 1 / static_cast<float>(1060 * std::pow(lattice.grid.cell_m, 3)));
  const VelocityUpdate update{1 - 25 * static_cast<float>(kStep), Vec3f(0, 0, -9.81f * static_cast<float>(kStep)), 5};
  for (auto _ : state) {
    add_forces(rows, false, x, f, width);
    move_nodes(update, static_cast<float>(kStep), 0, inverse, f, v, x);
  }
  count(state, lattice.cells.size());
}
void avx2_hexahedra(benchmark::State& state) {
  kernels_of(state, SimdWidth::eight);
}
void avx512_hexahedra(benchmark::State& state) {
  kernels_of(state, SimdWidth::sixteen);
}

void implicit_sweep(benchmark::State& state) {
  const HexLattice lattice = lattice_of(cube(), grid_of(state));
  const double mu = 6000 / 2.9;
  const HexDescent descent(lattice, {mu, 10 * mu, 1060});
  std::vector<Vec3> x;
  for (std::uint32_t n = 0; n < lattice.nodes.size(); ++n) x.push_back(lattice.rest_m(n));
  const std::vector<Vec3> y = x;
  const std::vector<double> mass(x.size(), 1060 * std::pow(lattice.grid.cell_m, 3));
  for (auto _ : state) benchmark::DoNotOptimize(descent.sweep(0.001, mass, y, x));
  count(state, lattice.cells.size());
}

void make_lattice(benchmark::State& state) {
  const TetMesh mesh = test::tet_box(8, 8, 8, Vec3::Constant(kSide));
  const Grid grid = grid_around(mesh, kSide / static_cast<double>(state.range(0)));
  std::size_t cells = 0;
  for (auto _ : state) cells = lattice_of(mesh, grid).cells.size();
  count(state, cells);
}

// A small cut, again and again: the model follows.
void follow_cuts(benchmark::State& state) {
  const TetMesh mesh = test::tet_box(12, 12, 12, Vec3::Constant(kSide));
  const Grid grid = grid_around(mesh, kSide / static_cast<double>(state.range(0)));
  const HexSolid model(mesh, grid, {}, {});
  TetTopology volume(mesh);
  const Vec3 at = Vec3::Constant(0.051), u(0.004, 0, 0), w(0, 0.003, 0.003);
  cut(volume, {{at - u - w, at + u - w, at + u + w, at - u + w}}, {});
  const TetChange change = volume.change();
  for (auto _ : state) {
    state.PauseTiming();
    HexSolid followed(mesh, grid, {}, {});
    state.ResumeTiming();
    followed.change(change);
  }
  count(state, model.lattice().cells.size());
}

void print_ratios(const bench::BestTimes& best) {
  for (const char* across : {"8", "20"}) {
    const auto time = [&](const char* of) {
      const auto at = best.find(std::string(of) + "/" + across);
      return at == best.end() ? 0.0 : at->second;
    };
    if (time("hexahedra") > 0)
      std::fprintf(stderr,
                   "%s cells across: hexahedra %.1f times as fast as a plain loop, in registers of 8 %.1f times\n",
                   across, time("plain_elements") / time("hexahedra"), time("plain_elements") / time("avx2_hexahedra"));
  }
}

const bench::Subject subject("hexa", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("plain_elements", plain_elements)->Arg(8)->Arg(20);
  benchmark::RegisterBenchmark("hexahedra", hexahedra)->Arg(8)->Arg(20);
  benchmark::RegisterBenchmark("avx2_hexahedra", avx2_hexahedra)->Arg(8)->Arg(20);
  benchmark::RegisterBenchmark("avx512_hexahedra", avx512_hexahedra)->Arg(8)->Arg(20);
  benchmark::RegisterBenchmark("implicit_sweep", implicit_sweep)->Arg(8);
  benchmark::RegisterBenchmark("make_lattice", make_lattice)->Arg(8)->Arg(20);
  benchmark::RegisterBenchmark("follow_cuts", follow_cuts)->Arg(8)->Arg(20);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::hexa_bench
