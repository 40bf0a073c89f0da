// The way to any moment of a record (SECTIO_RECORD=FILE.mcap), as `sim_server play` goes it. Without a file there is
// nothing to measure.
#include <algorithm>
#include <cstdlib>
#include <random>

#include "common/core/processor_time.h"
#include "sim_server/net/played_record.h"
#include "tests/bench/bench.h"

namespace sectio::seek_bench {
namespace {

const char* record_path() {
  const char* path = std::getenv("SECTIO_RECORD");
  return path ? path : "";
}

void open_record(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(PlayedRecord(record_path()).end_s());
}

void seek_in_record(benchmark::State& state) {
  PlayedRecord record(record_path());
  std::mt19937 random(7);
  std::uniform_real_distribution<> moment_s(0, record.end_s());
  double most_s = 0;
  for (auto _ : state) {
    const double begun_s = processor_time_s();
    record.seek(moment_s(random));
    most_s = std::max(most_s, processor_time_s() - begun_s);
  }
  state.counters["most_ms"] = 1e3 * most_s;
  state.counters["record_s"] = record.end_s();
}

const bench::Subject subject("seek", [](int argc, char** argv) {
  if (*record_path() != 0) {
    benchmark::RegisterBenchmark("open_record", open_record)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("seek_in_record", seek_in_record)->Unit(benchmark::kMillisecond)->Iterations(100);
  }
  return bench::run(argc, argv);
});

}  // namespace
}  // namespace sectio::seek_bench
