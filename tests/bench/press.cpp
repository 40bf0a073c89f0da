// The cost of contact with temporary elements at 1 kHz (paper A, 2.2): a probe on an organ, a step of the whole
// simulation each, as ratios to a step in which nothing touches.
//
//   untouched  the probe is far away
//   asleep     the same, and the organ has come to rest
//   vertices   it presses by moving the vertices under it
//   rests      it presses with temporary elements, which stay
//   slides     the same at 2 cm/s: particles follow, templates are exchanged from face to face
//   churns     it jumps to another face in every step: all is undone and made anew
//
// The same on a block of tetrahedra, by moving vertices: a probe with a ball of 1.5 mm, and of 4 mm, rests, and slides.
#include <array>
#include <cstdio>

#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/bench/bench.h"
#include "tests/support/shapes.h"

namespace sectio::press_bench {
namespace {

constexpr double kRadius_m = 0.06, kTop_m = 0.03, kDepth_m = 0.003;

Scene organ(int levels, const char* style) {
  Scene scene;
  scene.step_s = 5e-4;
  BodySpec body;
  body.name = "organ";
  body.mesh = test::ellipsoid(levels, Vec3(kRadius_m, kRadius_m, kTop_m));
  body.material.skin_thickness_m = 0.004;
  body.material.foundation_radius_m = 0.02;
  body.contact.style = style;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -0.01)};
  scene.bodies.push_back(std::move(body));
  scene.tools.resize(1);
  scene.tools[0].kind = "probe";
  scene.tools[0].geometry = instrument_of("probe").geometry;
  return scene;
}

double height_m(double x_m, double y_m) {
  return kTop_m * std::sqrt(1 - (x_m * x_m + y_m * y_m) / (kRadius_m * kRadius_m));
}

// `at(k)`: x and y of the probe in step k, and its depth.
template <class At>
void run(benchmark::State& state, const char* style, const At& at, double sleep_after_s = 0) {
  Scene scene = organ(static_cast<int>(state.range(0)), style);
  scene.sleep.after_s = sleep_after_s;
  Simulation simulation(prepared(scene));
  std::uint64_t k = 0, deltas = 0;
  const auto step = [&] {
    const Vec3 p = at(k);
    ++k;
    const Pose pose{Vec3(p.x(), p.y(), height_m(p.x(), p.y()) - p.z()), Eigen::Quaterniond::Identity()};
    StepInput input;
    input.samples.push_back({0, k, static_cast<double>(k) * scene.step_s, pose});
    deltas += simulation.step(input).deltas.size();
  };
  for (int i = 0; i < 300; ++i) step();
  for (int i = 0; i < 100000 && sleep_after_s > 0 && !simulation.asleep(0); ++i) step();
  if (simulation.asleep(0) != (sleep_after_s > 0)) return state.SkipWithError("it does not rest");
  deltas = 0;
  for (auto _ : state) step();
  state.counters["triangles"] = simulation.mesh(0).triangle_count();
  state.counters["deltas_a_step"] = static_cast<double>(deltas) / static_cast<double>(state.iterations());
}

// From above onto the organ in the first steps.
double sunk_m(std::uint64_t k) {
  return std::min(kDepth_m, -0.002 + 5e-5 * static_cast<double>(k));
}

void untouched(benchmark::State& state) {
  run(state, "vertices", [](std::uint64_t) { return Vec3(0.003, 0.002, -0.1); });
}
void asleep(benchmark::State& state) {
  run(
      state, "vertices", [](std::uint64_t) { return Vec3(0.003, 0.002, -0.1); }, 0.2);
}
void vertices(benchmark::State& state) {
  run(state, "vertices", [](std::uint64_t k) { return Vec3(0.003, 0.002, sunk_m(k)); });
}
void rests(benchmark::State& state) {
  run(state, "templates", [](std::uint64_t k) { return Vec3(0.003, 0.002, sunk_m(k)); });
}
void slides(benchmark::State& state) {
  run(state, "templates", [](std::uint64_t k) {
    const double a = 1e-5 / 0.015 * static_cast<double>(k);
    return Vec3(0.015 * std::cos(a), 0.015 * std::sin(a), sunk_m(k));
  });
}
void churns(benchmark::State& state) {
  run(state, "templates", [](std::uint64_t k) {
    const double step = k > 200 && k % 2 == 1 ? 0.004 : 0;
    return Vec3(0.003 + step, 0.002, sunk_m(k));
  });
}

// The ball's lowest point in the middle of the block's top, at a depth; a ball of no radius is far away.
void block(benchmark::State& state, double radius_m, double slides_m_per_s) {
  Scene scene;
  scene.gravity_m_per_s2 = Vec3::Zero();
  BodySpec body;
  body.name = "block";
  body.model = "neo_hookean";
  body.mesh = test::box(12, 8, 6, Vec3(0.06, 0.04, 0.03));
  body.volume.tetrahedra = static_cast<double>(state.range(0));
  body.material.young_pa = 6000;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.001)};
  scene.bodies.push_back(std::move(body));
  scene.tools.resize(1);
  scene.tools[0].kind = "probe";
  scene.tools[0].geometry = instrument_of("probe").geometry;
  scene.tools[0].geometry.sphere_radius_m = std::max(radius_m, 0.0015);
  scene.sleep.after_s = 0;
  Simulation simulation(prepared(scene));
  std::uint64_t k = 0;
  const auto step = [&] {
    ++k;
    const double time_s = 1e-3 * static_cast<double>(k), way_m = 0.01 * std::sin(slides_m_per_s / 0.01 * time_s);
    const double depth_m = radius_m > 0 ? std::min(kDepth_m, -0.002 + 5e-5 * static_cast<double>(k)) : -0.1;
    StepInput input;
    const Vec3 tip(0.03 + way_m, 0.02, 0.03 + radius_m - depth_m);
    input.samples.push_back({0, k, time_s, {tip, Eigen::Quaterniond::Identity()}});
    benchmark::DoNotOptimize(simulation.step(input).step);
  };
  for (int i = 0; i < 300; ++i) step();
  for (auto _ : state) step();
}
void block_alone(benchmark::State& state) {
  block(state, 0, 0);
}
void ball_of_1_5_mm(benchmark::State& state) {
  block(state, 0.0015, 0);
}
void ball_of_4_mm(benchmark::State& state) {
  block(state, 0.004, 0);
}
void ball_of_4_mm_slides(benchmark::State& state) {
  block(state, 0.004, 0.02);
}
void volumes(benchmark::internal::Benchmark* b) {
  b->Arg(6000)->Arg(24000)->Iterations(500)->Repetitions(3)->Unit(benchmark::kMicrosecond);
}

void sizes(benchmark::internal::Benchmark* b) {
  b->Arg(3)->Arg(5)->Iterations(4000)->Repetitions(3)->Unit(benchmark::kMicrosecond);
}

void print_ratios(const bench::BestTimes& best) {
  for (const std::string tetrahedra : {"6000", "24000"}) {
    const auto base = best.find("block_alone/" + tetrahedra);
    if (base == best.end()) continue;
    for (const std::string name : {"ball_of_1_5_mm", "ball_of_4_mm", "ball_of_4_mm_slides"})
      if (const auto t = best.find(name + "/" + tetrahedra); t != best.end())
        std::fprintf(stderr, "%s: %.3g times as long as an untouched step of %s tetrahedra, %.0f us more\n",
                     name.c_str(), t->second / base->second, tetrahedra.c_str(), t->second - base->second);
  }
  for (const std::string levels : {"3", "5"}) {
    const auto of = [&](const std::string& name) { return best.find(name + "/" + levels); };
    const auto base = of("untouched");
    if (base == best.end()) continue;
    for (const std::string name : {"asleep", "vertices", "rests", "slides", "churns"})
      if (const auto t = of(name); t != best.end())
        std::fprintf(stderr, "%s takes %.3g times as long as an untouched step of %s triangles\n", name.c_str(),
                     t->second / base->second, levels == "3" ? "1280" : "20480");
  }
}

const bench::Subject subject("press", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("block_alone", block_alone)->Apply(volumes);
  benchmark::RegisterBenchmark("ball_of_1_5_mm", ball_of_1_5_mm)->Apply(volumes);
  benchmark::RegisterBenchmark("ball_of_4_mm", ball_of_4_mm)->Apply(volumes);
  benchmark::RegisterBenchmark("ball_of_4_mm_slides", ball_of_4_mm_slides)->Apply(volumes);
  benchmark::RegisterBenchmark("untouched", untouched)->Apply(sizes);
  benchmark::RegisterBenchmark("asleep", asleep)->Apply(sizes);
  benchmark::RegisterBenchmark("vertices", vertices)->Apply(sizes);
  benchmark::RegisterBenchmark("rests", rests)->Apply(sizes);
  benchmark::RegisterBenchmark("slides", slides)->Apply(sizes);
  benchmark::RegisterBenchmark("churns", churns)->Apply(sizes);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::press_bench
