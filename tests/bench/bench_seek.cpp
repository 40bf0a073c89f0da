// The way to any moment of a session: SECTIO_PAST=FILE.mcap, or DIRECTORY/inputs with its checkpoints, as `sim_server
// play` takes them. Moments are drawn from the whole of it; the time is the processor's, that of the longest one beside.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "common/core/processor_time.h"
#include "sim_server/commands/recorded_scene.h"
#include "sim_server/net/played_record.h"
#include "sim_server/session/played_inputs.h"

namespace sectio {
namespace {

const char* past() {
  const char* path = std::getenv("SECTIO_PAST");
  return path ? path : "";
}

void seek_often(benchmark::State& state, double end_s, const auto& seek) {
  std::mt19937 random(7);
  double most_s = 0;
  for (auto _ : state) {
    const double begun_s = processor_time_s();
    seek(std::uniform_real_distribution<>(0, end_s)(random));
    most_s = std::max(most_s, processor_time_s() - begun_s);
  }
  state.counters["most_ms"] = 1e3 * most_s;
  state.counters["session_s"] = end_s;
}

void open_record(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(PlayedRecord(past()).end_s());
}

void seek_in_record(benchmark::State& state) {
  PlayedRecord record(past());
  seek_often(state, record.end_s(), [&](double to_s) { record.seek(to_s); });
}

void seek_in_inputs(benchmark::State& state) {
  const Scene scene = recorded_scene(past());
  seek_often(state, scene.duration_s, [&](double to_s) {
    SessionRun run(scene, "");
    PlayedInputs(past(), run).run_unseen(run, scene.step_s, to_s);
  });
}

const bool is_registered = [] {
  if (is_mcap(past())) {
    benchmark::RegisterBenchmark("open_record", open_record)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("seek_in_record", seek_in_record)->Unit(benchmark::kMillisecond)->Iterations(40);
  } else if (is_input_log(past())) {
    benchmark::RegisterBenchmark("seek_in_inputs", seek_in_inputs)->Unit(benchmark::kMillisecond)->Iterations(40);
  }
  return true;
}();

}  // namespace
}  // namespace sectio
