// Steps that cut, whole: each step of a scene in which the mesh changes, in processor's time, with 10 000 triangles,
// with 20 000 tetrahedra, and with 100 000 in steps of a thirtieth of a second. A scene is played several times, and a
// step counts with its fastest time: other work of the machine is no part of the step.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "common/core/processor_time.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/bench/bench.h"

namespace sectio::cut_steps_bench {
namespace {

constexpr int kTimes = 3;

struct StepTime {
  double s = 1e9;
  bool cuts = false;
};

void play(const Scene& scene, std::vector<StepTime>& steps) {
  Simulation simulation(scene);
  StepInput input;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    input.samples = samples_of_traces(scene, k + 1);
    const double start_s = processor_time_s();
    const StepOutput& output = simulation.step(input);
    steps[k].s = std::min(steps[k].s, processor_time_s() - start_s);
    steps[k].cuts = !output.deltas.empty();
  }
}

void print(const char* what, std::vector<double> times_s) {
  if (times_s.empty()) return;
  std::sort(times_s.begin(), times_s.end());
  const auto at = [&](double share) {
    return 1e3 * times_s[static_cast<std::size_t>(share * static_cast<double>(times_s.size() - 1))];
  };
  std::printf("%s: %zu steps, median %.3f ms, 99th percentile %.3f ms, longest %.3f ms\n", what, times_s.size(),
              at(0.5), at(0.99), at(1));
}

Scene scene_of(const std::string& name) {
  return load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/" + name + ".yaml", standard_traits());
}

void run(const char* name, Scene scene) {
  scene = prepared(std::move(scene));
  std::vector<StepTime> steps(steps_of(scene, 0));
  for (int i = 0; i < kTimes; ++i) play(scene, steps);
  std::vector<double> cut_s, other_s;
  for (const StepTime& step : steps) (step.cuts ? cut_s : other_s).push_back(step.s);
  const BodySpec& body = scene.bodies[0];
  if (!body.tets.tetrahedra.empty())
    std::printf("%s, %zu tetrahedra\n", name, body.tets.tetrahedra.size());
  else
    std::printf("%s, %zu triangles\n", name, body.mesh.triangles.size());
  print("  steps that cut", cut_s);
  print("  other steps", other_s);
  double sum_s = 0;
  for (const StepTime& step : steps) sum_s += step.s;
  std::printf("  all: %.2f s of processor's time for a second\n",
              sum_s / (scene.step_s * static_cast<double>(steps.size())));
  std::fflush(stdout);
}

const bench::Subject subject("cut_steps", [](int, char**) {
  for (const char* name : {"liver_incision", "kidney_loop"}) run(name, scene_of(name));
  Scene bar = scene_of("bar_volume_cut");
  bar.bodies[0].volume.tetrahedra = 20000;
  run("bar_volume_cut", std::move(bar));
  bar = scene_of("bar_long_steps");
  bar.bodies[0].volume.tetrahedra = 95000;
  bar.step_s = 1.0 / 30;
  run("bar_long_steps", std::move(bar));
  return 0;
});

}  // namespace
}  // namespace sectio::cut_steps_bench
