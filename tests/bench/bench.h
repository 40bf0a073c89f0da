// `bench SUBJECT [options]` is the program of all benchmarks, with a file for each subject. Speeds are judged by ratios
// of the best times within one run: a machine's own speed and its other work cancel out. Time is processor time:
// work that waits for a core is not slow.
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <map>
#include <string>

namespace sectio::bench {

// By "function/arguments", in the unit that the benchmark reports.
using BestTimes = std::map<std::string, double>;

// An object of a source makes the subject known; `run` gets the arguments from the subject's name on, as main() would.
struct Subject {
  Subject(const char* name, int (*run)(int argc, char** argv));
};

// Runs the benchmarks that are registered. `print` writes to stderr: the report proper stays readable by machines.
int run(
    int argc, char** argv, const std::function<void(const BestTimes&)>& print = [](const BestTimes&) {});

}  // namespace sectio::bench
