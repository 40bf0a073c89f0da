// The best time of each benchmark of a run, for ratios within it. Speeds are judged by these: a machine's own speed
// and its other work cancel out. Time is the processor's: what waits for a core is not slow.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <map>
#include <string>

namespace sectio::bench {

// By "function/arguments", in the unit that the benchmark reports.
using BestTimes = std::map<std::string, double>;

// Passes everything on to a reporter of the library.
template <class Base>
class KeepBest : public Base {
 public:
  void ReportRuns(const std::vector<benchmark::BenchmarkReporter::Run>& runs) override {
    for (const auto& run : runs) {
      if (run.run_type != benchmark::BenchmarkReporter::Run::RT_Iteration) continue;
      const double t = run.GetAdjustedCPUTime();
      const auto [at, is_new] = times.try_emplace(run.run_name.function_name + "/" + run.run_name.args, t);
      if (!is_new) at->second = std::min(at->second, t);
    }
    Base::ReportRuns(runs);
  }
  BestTimes times;
};

// main() of a benchmark that ends with ratios. `print` writes to stderr: the report proper stays readable by machines.
template <class Print>
int run(int argc, char** argv, const Print& print) {
  bool json = false;
  for (int i = 1; i < argc; ++i) json = json || std::string(argv[i]) == "--benchmark_format=json";
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const auto report_with = [&](auto reporter) {
    benchmark::RunSpecifiedBenchmarks(&reporter);
    print(reporter.times);
    return 0;
  };
  return json ? report_with(KeepBest<benchmark::JSONReporter>()) : report_with(KeepBest<benchmark::ConsoleReporter>());
}

}  // namespace sectio::bench
