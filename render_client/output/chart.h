// Lines, points and coloured cells as a picture: axes with round ticks, units in the labels, a legend.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render_client/draw/image.h"

namespace sectio {

struct Series {
  enum class Style { line, points, dashes };

  std::string name;       // for the legend
  std::vector<double> x;  // same length as y; a pair that is not finite breaks the line
  std::vector<double> y;
  Style style = Style::line;
  bool faint = false;  // a reference with which the others are compared
};

struct ChartLabels {
  std::string title;
  std::string x;  // with the unit: "time / s"
  std::string y;  // "force / N"
  bool y_from_zero = false;
  bool log_x = false, log_y = false;  // values that are not positive are not drawn
  struct Mark {
    double x = 0;
    std::string name;
  };
  std::vector<Mark> marks = {};  // vertical lines; the axis doesn't grow for them
};

// Without any finite point the axes run from 0 to 1. Throws InputError when a series has x and y of unequal length.
Image plot(const ChartLabels& labels, const std::vector<Series>& series, int width_px = 960, int height_px = 480);

// A value over two others, one entry a cell: x and y take the values of a grid, in any order. A value that is not
// finite is grey. Lines of series lie over the cells.
struct HeatMap {
  std::vector<double> x, y, value;
  std::string name;  // name of the value, with its unit
  // The values with the first and the last colour, which values beyond them have, too; empty: the least, the largest.
  std::optional<double> low = {}, high = {};
};
// Throws InputError when the three differ in length.
Image heat_map(const ChartLabels& labels, const HeatMap& map, const std::vector<Series>& series = {},
               int width_px = 960, int height_px = 560);

// The Pareto front where less is better in x and in y: the points that no other point beats in both, ascending in x.
Series front_of(const std::vector<Series>& series);

// Steps of 1, 2 or 5 times a power of ten: all multiples within [low, high], about `wanted` of them.
std::vector<double> round_ticks(double low, double high, int wanted);

}  // namespace sectio
