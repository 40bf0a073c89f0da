#include <algorithm>
#include <cstdio>

#include "tests/bench/bench.h"

namespace sectio::bench {
namespace {

std::map<std::string, int (*)(int argc, char** argv)>& subjects() {
  static std::map<std::string, int (*)(int argc, char** argv)> subjects;
  return subjects;
}

// Passes everything on to a reporter of the library.
template <class Base>
class KeepBest : public Base {
 public:
  void ReportRuns(const std::vector<benchmark::BenchmarkReporter::Run>& runs) override {
    for (const auto& run : runs) {
      failed |= run.error_occurred;
      if (run.error_occurred) continue;
      if (run.run_type != benchmark::BenchmarkReporter::Run::RT_Iteration) continue;
      const double t = run.GetAdjustedCPUTime();
      const auto [at, is_new] = times.try_emplace(run.run_name.function_name + "/" + run.run_name.args, t);
      if (!is_new) at->second = std::min(at->second, t);
    }
    Base::ReportRuns(runs);
  }
  BestTimes times;
  bool failed = false;
};

}  // namespace

Subject::Subject(const char* name, int (*run)(int argc, char** argv)) {
  subjects()[name] = run;
}

int run(int argc, char** argv, const std::function<void(const BestTimes&)>& print) {
  bool json = false;
  for (int i = 1; i < argc; ++i) json = json || std::string(argv[i]) == "--benchmark_format=json";
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const auto report_with = [&](auto reporter) {
    benchmark::RunSpecifiedBenchmarks(&reporter);
    print(reporter.times);
    return reporter.failed ? 1 : 0;
  };
  return json ? report_with(KeepBest<benchmark::JSONReporter>()) : report_with(KeepBest<benchmark::ConsoleReporter>());
}

}  // namespace sectio::bench

// Without a subject it says which there are.
int main(int argc, char** argv) {
  const auto& subjects = sectio::bench::subjects();
  const auto subject = subjects.find(argc > 1 ? argv[1] : "");
  if (subject != subjects.end()) return subject->second(argc - 1, argv + 1);
  for (const auto& [name, run] : subjects) std::puts(name.c_str());
  return argc > 1 ? 2 : 0;
}
