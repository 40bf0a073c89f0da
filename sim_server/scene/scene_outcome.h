// The outcome of a run in numbers; under `expect:` a scene gives a range for each. Plain values.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim_server/scene/key.h"

namespace sectio {

// Things at the end of a run, and counts over all of it. A family is a body of the scene with all that came
// off it; its largest part, by volume, is the body still, and the others are freed. An incision is a connected set of
// walls; a freed piece took one of its own with it, which doesn't count.
struct Outcome {
  double incisions = 0, cut_m = 0, pieces_freed = 0;
  double freed_ml = 0, removed_ml = 0;
  double freed_moved_m = 0, largest_displacement_m = 0;
  double refusals = 0, joins = 0, contacts = 0, grasps = 0;
  double touched_s = 0, largest_force_n = 0, largest_penetration_m = 0, overlap_m = 0;
  double largest_speed_m_per_s = 0;
  double marked_removed_fraction = 0, marked_in_bin_fraction = 0, healthy_lost_ml = 0;  // with an exercise
  double line_cut_fraction = 0, line_deviation_m = 0, line_depth_m = 0;
  double spared_touches = 0;
};

// Scenes without this don't have the measure; all that follow `run` are of an exercise.
enum class MeasureOf : std::uint8_t { run, exercise, marked_tissue, bin, line };

struct Measure {
  std::string key, meaning;
  double Outcome::*value;
  Range possible;
  MeasureOf of = MeasureOf::run;
};
const std::vector<Measure>& measures();

struct Expectation {
  const Measure* measure = nullptr;
  Range range;
};

// For a person: "line deviation at most 2 mm", and the value as "3.10 mm".
std::string target_in_words(const Expectation& expectation);
// The task of an exercise and its targets, a line each.
std::vector<std::string> task_in_words(const std::string& task, std::span<const Expectation> expectations);
std::string value_in_words(const Measure& measure, double value);

// "pieces_freed: expected 1, got 0" for each expectation that an outcome doesn't meet. No range holds a NaN.
std::vector<std::string> unmet(std::span<const Expectation> expectations, const Outcome& outcome);

}  // namespace sectio
