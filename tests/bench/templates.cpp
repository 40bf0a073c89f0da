// The cost of cutting with templates, by figure of paper A (section 2.3): one step that needs the template, divided by
// the faces that it cuts. The second argument is how many triangles the pad has, all of the same size: only active
// faces are read, so that it must not matter.
//
// The last lines give the ratios (stderr): of each template to figure 10 right, and of the largest pad to the smallest.
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "sim_server/surface/cutting/template_cut.h"
#include "tests/bench/bench.h"
#include "tests/support/mesh_at_rest.h"
#include "tests/support/shapes.h"

namespace sectio::templates_bench {
namespace {

constexpr double kTop_m = 0.02;

RestBlade at(double x_m, double y_m, double depth_m) {
  return {Vec3(x_m, y_m, kTop_m - depth_m), Vec3::UnitZ()};
}

struct Situation {
  const char* figure;
  RestBlade first, last;
};
const std::array<Situation, 7> kSituations{{
    {"10 left", at(0.0115, 0.014, 0.006), at(0.0165, 0.014, 0.006)},
    {"10 right", at(0.0115, 0.014, 0.006), at(0.0485, 0.014, 0.006)},
    {"11 left", at(-0.005, 0.014, 0.003), at(0.0165, 0.014, 0.003)},
    {"11 right", at(-0.005, 0.014, 0.0083), at(0.0165, 0.014, 0.0083)},
    {"13", at(-0.005, 0.014, 0.025), at(0.0165, 0.014, 0.025)},
    {"14 left", at(0.0110, 0.017, -0.002), at(0.0150, 0.017, 0.006)},
    {"14 right", at(0.0120, 0.017, 0.005), at(0.0150, 0.017, 0.006)},
}};

// Cells of 10 mm; the cuts are in its corner.
const test::MeshAtRest& pad(std::int64_t triangles) {
  const int times = static_cast<int>(std::sqrt(static_cast<double>(triangles) / 100));
  static std::map<int, test::MeshAtRest> pads;
  const auto it = pads.find(times);
  if (it != pads.end()) return it->second;
  return pads
      .emplace(times, test::MeshAtRest(test::box(6 * times, 4 * times, 2, Vec3(0.06 * times, 0.04 * times, kTop_m))))
      .first->second;
}

// The triangles that a collision engine would find: all around the cut.
std::vector<TriangleId> around_the_cut(const TriangleMesh& mesh) {
  std::vector<TriangleId> found;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    const auto& v = mesh.triangle(t).v;
    const Vec3 centre = (mesh.rest_body_m(v[0]) + mesh.rest_body_m(v[1]) + mesh.rest_body_m(v[2])) / 3;
    if (centre.x() < 0.05 && centre.y() > 0.008 && centre.y() < 0.022) found.push_back(t);
  }
  return found;
}

void step(benchmark::State& state) {
  const Situation& s = kSituations[static_cast<std::size_t>(state.range(0))];
  const test::MeshAtRest& body = pad(state.range(1));
  const std::vector<TriangleId> active = around_the_cut(body.mesh);
  std::size_t faces = 0, steps = 0;
  bool used = false;
  for (auto _ : state) {
    MeshDraft draft(body.mesh, body.view());
    const TemplateStep cut = cut_with_templates(draft, s.first, s.last, {}, active, {});
    if (cut.outcome != TemplateOutcome::cut) state.SkipWithError("not cut");
    faces += cut.faces.size();
    ++steps;
    for (const ActiveFace& f : cut.faces) used |= std::string(f.chosen->figure) == s.figure;
  }
  if (!used) state.SkipWithError("the template was not chosen");
  state.SetLabel(std::string("figure ") + s.figure);
  state.counters["faces"] = static_cast<double>(faces) / static_cast<double>(steps);
  state.counters["per_face"] =
      benchmark::Counter(static_cast<double>(faces), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void print_ratios(const bench::BestTimes& best) {
  const auto time = [&](std::size_t figure, const char* times) {
    const auto it = best.find("step/" + std::to_string(figure) + "/" + times);
    return it != best.end() ? it->second : 0.0;
  };
  for (std::size_t i = 0; i < kSituations.size(); ++i)
    if (time(i, "2000") > 0 && time(1, "2000") > 0)
      std::fprintf(
          stderr,
          "figure %s: a step takes %.2f times as long as of figure 10 right, %.2f in 2 M triangles against 2 k\n",
          kSituations[i].figure, time(i, "2000") / time(1, "2000"), time(i, "2000000") / time(i, "2000"));
}

const bench::Subject subject("templates", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("step", step)
      ->ArgsProduct({benchmark::CreateDenseRange(0, 6, 1), {2000, 2000000}})
      ->Repetitions(3)
      ->Unit(benchmark::kMicrosecond);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::templates_bench
