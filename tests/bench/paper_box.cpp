// Paper C, figure 4: its box of 74 vertices, 196 tetrahedra and 1167 springs, at 150 steps per second on one thread of
// an i7-3770K at 3.5 GHz. Here: the model's step alone, and a step of the whole simulation of
// deploy/scenes/paper_box.yaml (three instruments, contact, grips and cuts) in the mean over the scene. The last lines
// compare.
#include <cstdio>
#include <fstream>
#include <string>

#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/bench/bench.h"

namespace sectio::paper_box_bench {
namespace {

constexpr double kPapersSteps_per_s = 150;

const Scene& scene() {
  static const Scene paper_box = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/paper_box.yaml", standard_traits());
  return paper_box;
}

void model(benchmark::State& state) {
  const Simulation simulation(prepared(scene()));
  const TetMesh& mesh = simulation.body(0).tets;
  VolumeMaterial material;
  material.young_pa = scene().bodies[0].material.young_pa;
  VolumeSettings settings;
  settings.step_s = scene().step_s;
  TetSprings springs(mesh, material, settings);
  std::vector<Vec4f> x(mesh.vertices_body_m.size(), Vec4f::Zero()), v = x;
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = mesh.vertices_body_m[i].cast<float>();
  for (auto _ : state) {
    springs.step(x, v, {}, {});
    benchmark::DoNotOptimize(x.data());
  }
  state.counters["springs"] = static_cast<double>(springs.springs().size());
  state.counters["parts_a_step"] = springs.substeps();
}

// One iteration is the whole scene.
void scene_of_paper(benchmark::State& state) {
  const std::uint64_t steps = steps_of(scene(), 0);
  for (auto _ : state) {
    state.PauseTiming();
    Simulation simulation(prepared(scene()));
    StepInput input;
    state.ResumeTiming();
    for (std::uint64_t k = 1; k <= steps; ++k) {
      input.samples = samples_of_traces(scene(), k);
      simulation.step(input);
    }
  }
  state.counters["steps"] = static_cast<double>(steps);
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "an unknown processor";
}

const bench::Subject subject("paper_box", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("model", model)->Unit(benchmark::kNanosecond);
  benchmark::RegisterBenchmark("scene_of_paper", scene_of_paper)->Unit(benchmark::kNanosecond)->Repetitions(3);
  return bench::run(argc, argv, [](const bench::BestTimes& times) {
    if (times.empty()) return;
    const auto compare = [](const char* what, double steps_per_s) {
      std::fprintf(stderr, "%s: %.0f steps per second, %.0f times the paper's %.0f\n", what, steps_per_s,
                   steps_per_s / kPapersSteps_per_s, kPapersSteps_per_s);
    };
    std::fprintf(stderr, "on one core of %s\n", processor().c_str());
    for (const auto& [name, ns] : times) {
      if (name.starts_with("model")) compare("the model alone", 1e9 / ns);
      if (name.starts_with("scene")) compare("the whole step", 1e9 * static_cast<double>(steps_of(scene(), 0)) / ns);
    }
  });
});

}  // namespace
}  // namespace sectio::paper_box_bench
