// The volume models against plain loops over springs and elements, in one run: the same springs or elements, gravity,
// damping and integration. The last lines give the ratios, and that of a sweep of the implicit driver to an evaluation
// by the explicit one.
#include <cstdio>
#include <string>

#include "sim_server/deformation/tetra/tet_kernel.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/deformation/tetra/tet_star.h"
#include "tests/bench/bench.h"
#include "tests/support/tet_shapes.h"

namespace sectio::volume_bench {
namespace {

constexpr double kStep = 1e-4;
const Vec3 kGravity(0, 0, -9.81);

// Cubes across: 5 tetrahedra each.
TetMesh block(std::int64_t cubes) {
  const int n = static_cast<int>(cubes);
  TetMesh mesh = test::tet_box(n, n, n, Vec3(0.1, 0.1, 0.1));
  test::jitter(mesh, 0.01 / n);
  return mesh;
}

std::vector<Vec4f> at_rest(const TetMesh& mesh) {
  std::vector<Vec4f> x(mesh.vertices_body_m.size(), Vec4f::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = mesh.vertices_body_m[i].cast<float>();
  return x;
}

void count(benchmark::State& state, const char* what, std::size_t n) {
  state.counters[what] = static_cast<double>(n);
  state.counters[std::string("ns_per_") + what] = benchmark::Counter(
      1e-9 * static_cast<double>(n), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

struct Particle {
  Vec3 x, v, f;
  double m;
};

VolumeSettings one_part() {
  VolumeSettings settings;
  settings.step_s = kStep;
  return settings;
}

void plain_springs(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  const TetSprings model(mesh, {}, one_part(), {0.5, 0, false});
  std::vector<Particle> particles;
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v)
    particles.push_back({mesh.vertices_body_m[v], Vec3::Zero(), Vec3::Zero(), model.mass_kg(v)});
  const std::vector<TetSprings::Spring> springs = model.springs();
  for (auto _ : state) {
    for (Particle& p : particles) p.f = p.m * kGravity - 25 * p.m * p.v;
    for (const TetSprings::Spring& s : springs) {
      Particle &a = particles[s.a], &b = particles[s.b];
      const Vec3 d = b.x - a.x;
      const Vec3 f = s.stiffness_n_per_m * (1 - s.rest_length_m / d.norm()) * d;
      a.f += f;
      b.f -= f;
    }
    for (Particle& p : particles) {
      p.v += kStep / p.m * p.f;
      p.x += kStep * p.v;
    }
  }
  count(state, "spring", springs.size());
}

void springs(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  TetSprings model(mesh, {}, one_part(), {0.5, 0, false});
  if (model.substeps() != 1) return state.SkipWithError("the step is not one part");
  std::vector<Vec4f> x = at_rest(mesh), v(x.size(), Vec4f::Zero());
  for (auto _ : state) model.step(x, v, {}, {});
  count(state, "spring", model.springs().size());
}

// Stable neo-Hookean elements with nodal pressures, as one would write them down with Eigen.
struct Element {
  Tetrahedron corners;
  Mat3 to_rest;  // inverse of the edges' matrix
  double volume;
};

void plain_elements(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  const double mu = 6000 / 2.9, kappa = mu + 2 * mu * 0.45 / 0.1;
  std::vector<Element> elements;
  std::vector<Particle> particles;
  std::vector<double> rest_volume(mesh.vertices_body_m.size(), 0), volume(rest_volume.size());
  for (const Vec3& x : mesh.vertices_body_m) particles.push_back({x, Vec3::Zero(), Vec3::Zero(), 0});
  const auto edges = [&](const Tetrahedron& c) {
    Mat3 d;
    for (int k = 0; k < 3; ++k) d.col(k) = particles[c[static_cast<std::size_t>(k) + 1]].x - particles[c[0]].x;
    return d;
  };
  for (const Tetrahedron& c : mesh.tetrahedra) {
    elements.push_back({c, edges(c).inverse(), tet_volume_m3(mesh, c)});
    for (const VertexId v : c) {
      rest_volume[v] += elements.back().volume;
      particles[v].m += 0.25 * 1060 * elements.back().volume;
    }
  }
  for (auto _ : state) {
    std::fill(volume.begin(), volume.end(), 0.0);
    for (const Element& e : elements) {
      const double now = edges(e.corners).determinant() / 6;
      for (const VertexId v : e.corners) volume[v] += now;
    }
    for (Particle& p : particles) p.f = p.m * kGravity - 25 * p.m * p.v;
    for (const Element& e : elements) {
      double pressure = 0;
      for (const VertexId v : e.corners) pressure += 0.25 * kappa * (volume[v] / rest_volume[v] - 1);
      const Mat3 f = edges(e.corners) * e.to_rest;
      const Mat3 p = mu * f + (pressure - mu) * f.determinant() * f.inverse().transpose();
      const Mat3 force = -e.volume * p * e.to_rest.transpose();
      for (std::size_t k = 0; k < 3; ++k) {
        particles[e.corners[k + 1]].f += force.col(static_cast<Eigen::Index>(k));
        particles[e.corners[0]].f -= force.col(static_cast<Eigen::Index>(k));
      }
    }
    for (Particle& p : particles) {
      p.v += kStep / p.m * p.f;
      p.x += kStep * p.v;
    }
  }
  count(state, "tet", elements.size());
}

void explicit_elements(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  TetSolid model(mesh, {}, one_part());
  if (model.substeps() != 1) return state.SkipWithError("the step is not one part");
  std::vector<Vec4f> x = at_rest(mesh), v(x.size(), Vec4f::Zero());
  for (auto _ : state) model.step(x, v, {}, {});
  count(state, "tet", mesh.tetrahedra.size());
}

void kernels_of(benchmark::State& state, SimdWidth width) {
  if (width == SimdWidth::sixteen && !has_avx512()) return state.SkipWithError("this processor has no AVX-512");
  const TetMesh mesh = block(state.range(0));
  const TetSolid model(mesh, {}, one_part());
  std::vector<Vec4f> x = at_rest(mesh), v(x.size(), Vec4f::Zero());
  const VelocityUpdate update{1 - 25 * static_cast<float>(kStep), Vec3f(0, 0, -9.81f * static_cast<float>(kStep)), 5};
  for (auto _ : state) {
    update_pressures(model.rows(), false, x, width);
    update_velocities(model.rows(), update, x, v, width);
    update_positions(static_cast<float>(kStep), v, x);
  }
  count(state, "tet", mesh.tetrahedra.size());
}
void avx2_elements(benchmark::State& state) {
  kernels_of(state, SimdWidth::eight);
}
void avx512_elements(benchmark::State& state) {
  kernels_of(state, SimdWidth::sixteen);
}

void implicit_sweep(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  const TetSolid model(mesh, {}, one_part());
  std::vector<Vec4f> x = at_rest(mesh);
  const std::vector<Vec4f> y = x;
  std::vector<TetBlockColumn> scratch(3 * model.rows().most_faces());
  update_pressures(model.rows(), false, x);
  for (auto _ : state) descend(model.rows(), 0.001f, y, x, {scratch.data()->bulk.data(), scratch.size() * kLanes});
  count(state, "tet", mesh.tetrahedra.size());
}

void print_ratios(const bench::BestTimes& best) {
  const auto ratio = [&](const std::string& of, const std::string& to, const std::string& cubes) {
    const auto a = best.find(of + "/" + cubes), b = best.find(to + "/" + cubes);
    return a == best.end() || b == best.end() || b->second == 0 ? 0.0 : a->second / b->second;
  };
  for (const char* cubes : {"6", "12", "24"})
    std::fprintf(stderr,
                 "%s cubes across: springs %.1f times a plain loop, explicit elements %.1f times, an implicit sweep "
                 "takes %.2f of an explicit evaluation\n",
                 cubes, ratio("plain_springs", "springs", cubes), ratio("plain_elements", "explicit_elements", cubes),
                 ratio("implicit_sweep", "explicit_elements", cubes));
}

const bench::Subject subject("volume", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("plain_springs", plain_springs)->Arg(6)->Arg(12)->Arg(24);
  benchmark::RegisterBenchmark("springs", springs)->Arg(6)->Arg(12)->Arg(24);
  benchmark::RegisterBenchmark("plain_elements", plain_elements)->Arg(6)->Arg(12)->Arg(24);
  benchmark::RegisterBenchmark("explicit_elements", explicit_elements)->Arg(6)->Arg(12)->Arg(24);
  benchmark::RegisterBenchmark("avx2_elements", avx2_elements)->Arg(6)->Arg(12)->Arg(24);
  benchmark::RegisterBenchmark("avx512_elements", avx512_elements)->Arg(6)->Arg(12)->Arg(24);
  benchmark::RegisterBenchmark("implicit_sweep", implicit_sweep)->Arg(6)->Arg(12)->Arg(24);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::volume_bench
