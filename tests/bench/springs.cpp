// The spring kernel against a plain array-of-structures loop over edges: the same springs, home springs, gravity,
// damping and integration, in one run. Counter ns_per_spring_step; the last lines give the ratios.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/surface_springs.h"
#include "tests/bench/bench.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::springs_bench {
namespace {

// An icosahedron, each triangle split in four until there are enough: closed, any size, and numbered as meshes from
// files are: neighbours are often, but not always, near in memory.
TriangleMesh organ_of(std::int64_t triangles) {
  int levels = 0;
  for (std::int64_t n = 20; n < triangles; n *= 4) ++levels;
  return TriangleMesh(test::ellipsoid({0.09, 0.06, 0.05}, levels));
}

struct Particle {
  Vec3 x, v, f, home;
  double m, k_home;
};

struct Spring {
  int a, b;
  double k, l0;
};

struct PlainBody {
  std::vector<Particle> particles;
  std::vector<Spring> springs;
};

// Springs in the order in which a program that walks the triangles meets the edges.
PlainBody plain_body(const TriangleMesh& mesh, const SurfaceSprings& body) {
  PlainBody plain;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    const Vec3 x = mesh.rest_body_m(v);
    plain.particles.push_back({x, Vec3::Zero(), Vec3::Zero(), x, body.mass_kg(v), double{body.rows().row(v).k_home}});
  }
  for (const Triangle& t : mesh.triangles()) {
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId a = t.v[i], b = t.v[(i + 1) % 3];
      if (a > b) continue;  // met from the other side
      for (std::uint32_t n = 0; n < body.rows().degree(a); ++n) {
        const HalfEdge e = body.rows().half_edge(a, n);
        if (e.to != b) continue;
        plain.springs.push_back({static_cast<int>(a), static_cast<int>(b), double{e.k}, double{e.k_l0} / double{e.k}});
      }
    }
  }
  return plain;
}

void plain_step(PlainBody& body, double h, double alpha, const Vec3& g) {
  for (Particle& p : body.particles) p.f = p.k_home * (p.home - p.x) - alpha * p.m * p.v + p.m * g;
  for (const Spring& s : body.springs) {
    Particle& a = body.particles[static_cast<std::size_t>(s.a)];
    Particle& b = body.particles[static_cast<std::size_t>(s.b)];
    const Vec3 d = b.x - a.x;
    const Vec3 f = s.k * (1 - s.l0 / d.norm()) * d;
    a.f += f;
    b.f -= f;
  }
  for (Particle& p : body.particles) {
    p.v += h / p.m * p.f;
    p.x += h * p.v;
  }
}

constexpr double kStep = 1e-4;

SurfaceSprings make_body(const TriangleMesh& mesh) {
  SurfaceSpringSettings settings;
  settings.step_s = kStep;
  return SurfaceSprings(mesh, {}, {}, settings);
}

void report(benchmark::State& state, std::size_t springs) {
  state.counters["springs"] = static_cast<double>(springs);
  state.counters["ns_per_spring_step"] = benchmark::Counter(
      1e-9 * static_cast<double>(springs), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void plain_loop(benchmark::State& state) {
  const TriangleMesh mesh = organ_of(state.range(0));
  PlainBody body = plain_body(mesh, make_body(mesh));
  for (auto _ : state) plain_step(body, kStep, 25, Vec3(0, 0, -9.81));
  report(state, body.springs.size());
}

void sell_kernel(benchmark::State& state) {
  const TriangleMesh mesh = organ_of(state.range(0));
  SurfaceSprings body = make_body(mesh);
  std::vector<Vec4f> x(mesh.vertex_slots(), Vec4f::Zero()), v(mesh.vertex_slots(), Vec4f::Zero());
  for (VertexId i = 0; i < mesh.vertex_slots(); ++i) x[i].head<3>() = mesh.rest_body_m(i).cast<float>();
  for (auto _ : state) body.step(x, v);
  report(state, mesh.triangle_count() * 3 / 2);
}

// The inner loops alone, in registers of 8 or 16 lanes.
void kernel_of(benchmark::State& state, SimdWidth width) {
  if (width == SimdWidth::sixteen && !has_avx512()) return state.SkipWithError("this processor has no AVX-512");
  const TriangleMesh mesh = organ_of(state.range(0));
  const SurfaceSprings body = make_body(mesh);
  std::vector<Vec4f> x(mesh.vertex_slots(), Vec4f::Zero()), v(mesh.vertex_slots(), Vec4f::Zero());
  for (VertexId i = 0; i < mesh.vertex_slots(); ++i) x[i].head<3>() = mesh.rest_body_m(i).cast<float>();
  const VelocityUpdate update{1 - 25 * static_cast<float>(kStep), Vec3f(0, 0, -9.81f * static_cast<float>(kStep)), 5};
  for (auto _ : state) {
    update_velocities(body.rows(), update, x, v, width);
    update_positions(static_cast<float>(kStep), v, x);
  }
  report(state, mesh.triangle_count() * 3 / 2);
}
void avx2_kernel(benchmark::State& state) {
  kernel_of(state, SimdWidth::eight);
}
void avx512_kernel(benchmark::State& state) {
  kernel_of(state, SimdWidth::sixteen);
}

// One changed star in meshes of all sizes: the cost must not depend on the mesh.
void local_update(benchmark::State& state) {
  const TriangleMesh mesh = organ_of(state.range(0));
  SurfaceSprings body = make_body(mesh);
  const Triangle& t = mesh.triangle(mesh.triangle_count() / 2);
  const std::vector<VertexId> touched(t.v.begin(), t.v.end());
  for (auto _ : state) body.update(mesh, touched);
  state.counters["triangles"] = static_cast<double>(mesh.triangle_count());
}

// To stderr, as in "speed-up over the plain loop, 1280 triangles: 7.5 (avx2 5.0, avx512 7.7)": of a whole step, and of
// the inner loops alone.
void print_ratios(const bench::BestTimes& best) {
  const std::string prefix = "plain_loop/";
  for (const auto& [name, t] : best) {
    if (!name.starts_with(prefix)) continue;
    const std::string triangles = name.substr(prefix.size());
    const auto ratio = [&, plain = t](const char* of) {
      const auto at = best.find(of + ("/" + triangles));
      return at == best.end() || at->second == 0 ? 0.0 : plain / at->second;
    };
    std::fprintf(stderr, "speed-up over the plain loop, %s triangles: %.1f (avx2 %.1f, avx512 %.1f)\n",
                 triangles.c_str(), ratio("sell_kernel"), ratio("avx2_kernel"), ratio("avx512_kernel"));
  }
}

const bench::Subject subject("springs", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("plain_loop", plain_loop)->Arg(1280)->Arg(20480)->Arg(81920);
  benchmark::RegisterBenchmark("sell_kernel", sell_kernel)->Arg(1280)->Arg(20480)->Arg(81920);
  benchmark::RegisterBenchmark("avx2_kernel", avx2_kernel)->Arg(1280)->Arg(20480)->Arg(81920);
  benchmark::RegisterBenchmark("avx512_kernel", avx512_kernel)->Arg(1280)->Arg(20480)->Arg(81920);
  benchmark::RegisterBenchmark("local_update", local_update)->Arg(1280)->Arg(20480)->Arg(327680);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::springs_bench
