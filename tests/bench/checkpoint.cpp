// A checkpoint of a liver of 40 000 triangles in the middle of a cut, beside a step of its simulation: the time of the
// simulation's thread, that of the thread that writes, and the way back. A checkpoint a second costs
// 100 (save + bytes) / 1 s % of a core, and its writing to the disk.
#include "sim_server/session/checkpoint.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/scene/mesh_import.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/bench/bench.h"

namespace sectio::checkpoint_bench {
namespace {

constexpr std::uint64_t kInTheCut = 2500;  // steps

Scene scene_of_a_cut() {
  Scene scene = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/liver_incision.yaml", standard_traits());
  scene.bodies[0].mesh = import_mesh(SECTIO_SOURCE_DIR "/deploy/meshes/liver_40k.obj", 1).soup;
  return prepared(std::move(scene));
}

struct Cut {
  Cut() : scene(scene_of_a_cut()), simulation(scene) {
    for (std::uint64_t step = 1; step <= kInTheCut; ++step) take(step);
  }
  void take(std::uint64_t step) {
    input.samples = samples_of_traces(scene, step);
    simulation.step(input);
  }

  Scene scene;
  Simulation simulation;
  StepInput input;
};

Cut& cut() {
  static Cut cut;
  return cut;
}

void step(benchmark::State& state) {
  std::uint64_t step = kInTheCut;
  for (auto _ : state) cut().take(++step);
}

void save(benchmark::State& state) {
  std::size_t bytes = 0;
  for (auto _ : state) bytes = cut().simulation.save().value().size();
  state.counters["bytes"] = static_cast<double>(bytes);
}

void bytes_with_their_checksum(benchmark::State& state) {
  Checkpoint checkpoint;
  checkpoint.simulation = cut().simulation.save().value();
  for (auto _ : state) benchmark::DoNotOptimize(to_bytes(checkpoint));
}

void load(benchmark::State& state) {
  const std::vector<std::uint8_t> saved = cut().simulation.save().value();
  for (auto _ : state) {
    Simulation simulation(cut().scene);
    simulation.load(saved);
  }
}

const bench::Subject subject("checkpoint", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("step", step)->Iterations(500)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("save", save)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("bytes_with_their_checksum", bytes_with_their_checksum)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("load", load)->Unit(benchmark::kMillisecond);
  return bench::run(argc, argv);
});

}  // namespace
}  // namespace sectio::checkpoint_bench
