// The cost of one step of a cut in bodies of 2 k to 2 M triangles: the same strokes through triangles of the same size,
// so that all that differs is how much mesh lies around. Nothing that a cut does may touch all of it.
//
//   cut_step  what a simulation does when a body is cut: plan, delta, springs and collision tree brought up to
//             date. Counter plan_us: the share of planning.
//
// The last lines give the ratios of the largest to the smallest body (stderr).
#include <array>
#include <cstdio>

#include "common/core/processor_time.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/world/body.h"
#include "tests/bench/bench.h"
#include "tests/support/shapes.h"

namespace sectio::cut_bench {
namespace {

constexpr double kCell_m = 0.002;
constexpr int kLayers = 4;
constexpr double kTop_m = kLayers * kCell_m;
constexpr double kStrokeLength_m = 0.024;
constexpr double kStep_m = 6e-5;  // a millisecond at 6 cm/s
constexpr int kStepsPerStroke = static_cast<int>(kStrokeLength_m / kStep_m);
constexpr std::array<double, 4> kStrokes_m{-0.009, -0.0033, 0.0031, 0.0087};  // off the middle of the pad
constexpr int kSteps = kStepsPerStroke * static_cast<int>(kStrokes_m.size());
constexpr double kDepth_m = 0.003;

// A square pad in cells of 2 mm, with so many triangles that it has `triangles` or a few less.
struct Pad {
  explicit Pad(std::int64_t triangles) {
    const double n = -kLayers + std::sqrt(kLayers * kLayers + static_cast<double>(triangles) / 4);
    cells = static_cast<int>(n);
    BodySpec body;
    body.name = "pad";
    body.mesh = test::box(cells, cells, kLayers, Vec3(cells * kCell_m, cells * kCell_m, kTop_m));
    body.material.skin_thickness_m = 0.004;
    scene.step_s = 2e-4;
    scene.bodies.push_back(std::move(body));
  }
  // The tip of stroke `stroke` after `step` steps. Cells and triangles around it are the same in every pad.
  Vec3 at(int stroke, int step) const {
    const double middle_m = cells / 2 * kCell_m;
    return {middle_m - kStrokeLength_m / 2 + step * kStep_m, middle_m + kStrokes_m[static_cast<std::size_t>(stroke)],
            kTop_m};
  }

  int cells = 0;
  Scene scene;
};

Blade blade_over(const Vec3& surface_m) {
  return {surface_m - kDepth_m * Vec3::UnitZ(), Vec3::UnitZ(), 1e9};
}

// Every step of all strokes once: step(entries, motions) says how long it took.
template <class Step>
void draw(benchmark::State& state, const Pad& pad, Body& body, const Step& step) {
  std::vector<TriangleId> under;  // each pose, before the cuts
  for (int k = 0; k < kSteps; ++k)
    under.push_back(
        body.tree().closest(body.view(), pad.at(k / kStepsPerStroke, k % kStepsPerStroke), kCell_m)->triangle);
  int k = 0;
  for (auto _ : state) {
    const int stroke = k / kStepsPerStroke, i = k % kStepsPerStroke;
    const TriangleId crossed = under[static_cast<std::size_t>(k++)];
    const Vec3 at = pad.at(stroke, i);
    std::vector<Entry> entries;
    if (i == 0) {
      const auto hit = body.tree().closest(body.view(), at, kCell_m);
      entries.push_back({0, hit->triangle, hit->bary});
    }
    const bool lift = i + 1 == kStepsPerStroke;
    const std::array motions{BladeMotion{0, {blade_over(at)}, lift, {crossed}}};
    state.SetIterationTime(step(entries, motions));
  }
  state.counters["triangles"] = static_cast<double>(body.mesh.triangle_count());
  state.counters["revisions"] = static_cast<double>(body.mesh.revision());
}

void cut_step(benchmark::State& state) {
  const Pad pad(state.range(0));
  Body body(pad.scene.bodies[0], pad.scene, 0, surface_spring_engines);
  body.tree();
  double plan_s = 0;
  draw(state, pad, body, [&](std::span<const Entry> entries, std::span<const BladeMotion> motions) {
    const double start_s = processor_time_s();
    const CutPlan plan = body.engines.cutting->plan(body.shared(), entries, motions);
    plan_s += processor_time_s() - start_s;
    if (!body.apply(cut_as_planned(plan)) || plan.refused) state.SkipWithError("a cut was refused");
    return processor_time_s() - start_s;
  });
  state.counters["plan_us"] = 1e6 * plan_s / kSteps;
}

void sizes(benchmark::internal::Benchmark* b) {
  for (const std::int64_t triangles : {2'000, 20'000, 200'000, 2'000'000}) b->Arg(triangles);
  b->Iterations(kSteps)->Repetitions(3)->UseManualTime()->Unit(benchmark::kMicrosecond);
}

void print_ratios(const bench::BestTimes& best) {
  const std::string name = "cut_step/";
  const auto small = best.find(name + "2000");
  for (const std::string triangles : {"20000", "200000", "2000000"})
    if (const auto large = best.find(name + triangles); large != best.end() && small != best.end())
      std::fprintf(stderr, "%s%s takes %.2f times as long as with 2000 triangles\n", name.c_str(), triangles.c_str(),
                   large->second / small->second);
}

const bench::Subject subject("cut", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("cut_step", cut_step)->Apply(sizes);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::cut_bench
