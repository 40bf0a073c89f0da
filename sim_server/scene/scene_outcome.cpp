#include "sim_server/scene/scene_outcome.h"

#include <algorithm>
#include <string_view>

#include "common/core/formatted.h"

namespace sectio {

const std::vector<Measure>& measures() {
  static const Range count = at_least(0), fraction = between(0, 1);
  static const std::vector<Measure> table = {
      {"incisions", "Cuts that don't meet; cuts that cross or go on from one another are one, both its sides together.",
       &Outcome::incisions, count},
      {"cut_m", "The length of all cuts along the skin at rest, half of what their lips measure.", &Outcome::cut_m,
       count},
      {"pieces_freed", "Pieces that came off what is held or, where nothing is, off the largest piece.",
       &Outcome::pieces_freed, count},
      {"freed_ml", "Volume of these pieces at rest.", &Outcome::freed_ml, count},
      {"removed_ml", "Volume at rest of fragments that were too small to be kept.", &Outcome::removed_ml, count},
      {"freed_moved_m", "The furthest that the middle of a freed piece is from its place at rest, in the end.",
       &Outcome::freed_moved_m, count},
      {"largest_displacement_m",
       "The furthest that a point of what has not been freed is from its place at rest, in the end.",
       &Outcome::largest_displacement_m, count},
      {"refusals", "Cuts that were refused.", &Outcome::refusals, count},
      {"joins", "Times that a cut ran into the end of another or of itself.", &Outcome::joins, count},
      {"contacts", "Times that an instrument began to touch tissue.", &Outcome::contacts, count},
      {"grasps", "Times that jaws took hold.", &Outcome::grasps, count},
      {"touched_s", "How long any instrument touched tissue.", &Outcome::touched_s, count},
      {"largest_force_n", "The largest force on an instrument.", &Outcome::largest_force_n, count},
      {"largest_penetration_m", "The furthest that an instrument which presses got beneath a surface.",
       &Outcome::largest_penetration_m, count},
      {"largest_speed_m_per_s", "The fastest that a point of tissue has moved.", &Outcome::largest_speed_m_per_s,
       count},
      {"overlap_m", "The furthest that a body lies in another one, in the end.", &Outcome::overlap_m, count},
      {"marked_removed_fraction", "With an exercise: the share of the marked tissue that is off the organ.",
       &Outcome::marked_removed_fraction, fraction, MeasureOf::marked_tissue},
      {"marked_in_bin_fraction", "With an exercise: the share of the marked tissue that is in the bin.",
       &Outcome::marked_in_bin_fraction, fraction, MeasureOf::bin},
      {"healthy_lost_ml", "With an exercise: the tissue that came off beside what is marked.",
       &Outcome::healthy_lost_ml, count, MeasureOf::exercise},
      {"line_cut_fraction",
       "With a line to cut: the share of it that was cut, near enough and half as deep as it should be.",
       &Outcome::line_cut_fraction, fraction, MeasureOf::line},
      {"line_deviation_m",
       "With a line to cut: how far beside it the cut is (root mean square); its length when nothing was cut.",
       &Outcome::line_deviation_m, count, MeasureOf::line},
      {"line_depth_m",
       "With a line to cut: the mean depth of the cut; where a blade has passed several times, the deepest counts.",
       &Outcome::line_depth_m, count, MeasureOf::line},
      {"spared_touches", "With an exercise: times that an instrument began to touch a body that it should spare.",
       &Outcome::spared_touches, count, MeasureOf::exercise}};
  return table;
}

namespace {

// The end of a key, as people have it.
struct Unit {
  std::string_view of_key, name;
  double per_unit = 1;
  int decimals = 0;
};
Unit unit_for(const Measure& measure) {
  for (const Unit& unit : {Unit{"_m", " mm", 1e3, 2}, Unit{"_fraction", " %", 100, 1}, Unit{"_ml", " ml", 1, 3}})
    if (measure.key.ends_with(unit.of_key)) return unit;
  return {};
}

}  // namespace

std::string target_in_words(const Expectation& expectation) {
  const Unit unit = unit_for(*expectation.measure);
  std::string name = expectation.measure->key;
  name.resize(name.size() - unit.of_key.size());
  std::ranges::replace(name, '_', ' ');
  Range range = expectation.range;
  range.low *= unit.per_unit;
  range.high *= unit.per_unit;
  return name + " " + range.in_words() + std::string(unit.name);
}

std::vector<std::string> task_in_words(const std::string& task, std::span<const Expectation> expectations) {
  std::vector<std::string> lines;
  if (!task.empty()) lines.push_back(task);
  for (const Expectation& e : expectations) lines.push_back(target_in_words(e));
  return lines;
}

std::string value_in_words(const Measure& measure, double value) {
  const Unit unit = unit_for(measure);
  return formatted("%.*f", unit.decimals, unit.per_unit * value) + std::string(unit.name);
}

std::vector<std::string> unmet(std::span<const Expectation> expectations, const Outcome& outcome) {
  std::vector<std::string> reasons;
  for (const Expectation& e : expectations) {
    const double got = outcome.*e.measure->value;
    if (e.range.contains(got)) continue;
    reasons.push_back(e.measure->key + ": expected " + e.range.in_words() + formatted(", got %.6g", got));
  }
  return reasons;
}

}  // namespace sectio
