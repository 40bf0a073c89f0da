// A scene played many times, each time by a hand with another seed, in processes of their own: a run that crashes or
// doesn't end is a failure, and the others go on.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sim_server/trials/hand.h"

namespace sectio {

struct TrialsOptions {
  Hand hand = {};
  std::uint32_t runs = 1;
  std::uint64_t seed = 1;  // seed of the first run; each of the others has the next one
  std::uint32_t processes = 1;
  std::uint32_t processor_limit_s = 900;  // limit of a run
};

struct Trial {
  std::uint64_t seed = 0;
  std::vector<std::string> reasons;  // reasons in report.json; or that it crashed, was refused or didn't end. Empty: ok
};

// In the order of their seeds. `done` is called after each run, as they end. The scene is a prepared one. A stop signal
// that the program catches ends those that still run, and leaves the trials so far. Forks: the calling process has one
// thread.
std::vector<Trial> run_trials(const Scene& scene, const TrialsOptions& options,
                              const std::function<void(const Trial&)>& done);

struct Rate {
  std::uint32_t good = 0, all = 0;
};
Rate rate_of(const std::vector<Trial>& trials);

// Wilson's score interval, 95 %: where the rate of infinitely many runs may well be.
struct Interval {
  double low = 0, high = 1;
};
Interval wilson(const Rate& rate);

}  // namespace sectio
