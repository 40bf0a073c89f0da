// A chart of columns of a table.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "render_client/output/chart.h"
#include "render_client/output/png.h"
#include "render_client/output/table.h"

namespace sectio {
namespace {

struct Options {
  std::string table, x, by, faint, panels, heat, heat_label, frontier;
  double heat_from = std::numeric_limits<double>::quiet_NaN(), heat_to = heat_from;
  std::vector<std::string> y, where, marks;
  bool front = false;
};

// The text before and after the first "=".
std::pair<std::string, std::string> split_at_equals(const std::string& flag, const std::string& text) {
  const auto at = text.find('=');
  if (at == std::string::npos) throw InputError(flag + " " + text + ": expected NAME=VALUE");
  return {text.substr(0, at), text.substr(at + 1)};
}

// For each line of the table: every --where accepts it.
std::vector<bool> chosen_lines(const Options& options) {
  std::vector<bool> is_chosen(read_text_column(options.table, options.x).size(), true);
  for (const std::string& where : options.where) {
    const auto [name, value] = split_at_equals("--where", where);
    const std::vector<std::string> column = read_text_column(options.table, name);
    for (std::size_t i = 0; i < column.size(); ++i) is_chosen[i] = is_chosen[i] && column[i] == value;
  }
  return is_chosen;
}

// A cell that is not a number becomes a NaN, which is left out of the picture.
double number_or_nan(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end == text.c_str() + text.size() && !text.empty() ? value : std::numeric_limits<double>::quiet_NaN();
}

// A series for each value of the column `by`, in the order of the table, faint ones last.
std::vector<Series> groups(const Options& options) {
  const std::vector<bool> is_chosen = chosen_lines(options);
  const auto x = read_text_column(options.table, options.x), y = read_text_column(options.table, options.y[0]),
             by = read_text_column(options.table, options.by);
  const auto faint =
      options.faint.empty() ? std::pair<std::string, std::string>() : split_at_equals("--faint", options.faint);
  const auto faint_column =
      options.faint.empty() ? std::vector<std::string>(x.size()) : read_text_column(options.table, faint.first);
  std::vector<Series> series;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double at_x = number_or_nan(x[i]), at_y = number_or_nan(y[i]);
    if (!std::isfinite(at_x) || !std::isfinite(at_y)) continue;
    auto of = std::find_if(series.begin(), series.end(), [&](const Series& s) { return s.name == by[i]; });
    if (of == series.end()) {
      series.push_back(
          {by[i], {}, {}, Series::Style::points, !options.faint.empty() && faint_column[i] == faint.second});
      of = series.end() - 1;
    }
    if (!is_chosen[i]) continue;  // a group has its colour, whichever lines are chosen
    of->x.push_back(at_x);
    of->y.push_back(at_y);
  }
  std::stable_partition(series.begin(), series.end(), [](const Series& s) { return !s.faint; });
  return series;
}

std::vector<Series> lines(const Options& options) {
  std::vector<std::string> names{options.x};
  names.insert(names.end(), options.y.begin(), options.y.end());
  const auto columns = read_columns(options.table, names);
  std::vector<Series> series;
  for (std::size_t i = 0; i < options.y.size(); ++i) series.push_back({options.y[i], columns[0], columns[i + 1]});
  return series;
}

constexpr int kWidth_px = 960, kHeight_px = 480, kHeightOfGroups_px = 560;

Image grouped(const Options& options, const ChartLabels& labels) {
  std::vector<Series> series = groups(options);
  if (options.front) series.push_back(front_of(series));
  return plot(labels, series, kWidth_px, kHeightOfGroups_px);
}

// Coloured cells over x and y, and the frontier as a line over x; lines of the table with the same x have the same one.
Image heated(const Options& options, const ChartLabels& labels) {
  const std::vector<bool> is_chosen = chosen_lines(options);
  const auto x = read_text_column(options.table, options.x), y = read_text_column(options.table, options.y[0]),
             value = read_text_column(options.table, options.heat);
  const auto height =
      options.frontier.empty() ? std::vector<std::string>(x.size()) : read_text_column(options.table, options.frontier);
  HeatMap map;
  map.name = options.heat_label.empty() ? options.heat : options.heat_label;
  if (std::isfinite(options.heat_from)) map.low = options.heat_from;
  if (std::isfinite(options.heat_to)) map.high = options.heat_to;
  std::map<double, double> frontier;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!is_chosen[i]) continue;
    map.x.push_back(number_or_nan(x[i]));
    map.y.push_back(number_or_nan(y[i]));
    map.value.push_back(number_or_nan(value[i]));
    if (!options.frontier.empty()) frontier[map.x.back()] = number_or_nan(height[i]);
  }
  std::vector<Series> series;
  if (!options.frontier.empty()) series.push_back({options.frontier, {}, {}, Series::Style::dashes});
  for (const auto& [at_x, at_y] : frontier) {
    series[0].x.push_back(at_x);
    series[0].y.push_back(at_y);
  }
  return heat_map(labels, map, series, kWidth_px, kHeightOfGroups_px);
}

Image chart_of_lines(const Options& options, const ChartLabels& labels) {
  return options.heat.empty() ? grouped(options, labels) : heated(options, labels);
}

// One chart for each value of the column --panels, two in a row.
Image in_panels(Options options, ChartLabels labels) {
  std::vector<std::string> values;
  for (const std::string& value : read_text_column(options.table, options.panels))
    if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
  Image all(2 * kWidth_px, static_cast<int>(values.size() + 1) / 2 * kHeightOfGroups_px, {255, 255, 255, 255});
  const std::vector<std::string> where = options.where;
  for (std::size_t i = 0; i < values.size(); ++i) {
    options.where = where;
    options.where.push_back(options.panels + "=" + values[i]);
    labels.title = values[i];
    paste(all, chart_of_lines(options, labels), static_cast<int>(i % 2) * kWidth_px,
          static_cast<int>(i / 2) * kHeightOfGroups_px);
  }
  return all;
}

int run(int argc, char** argv) {
  Options options;
  ChartLabels labels;
  std::string picture = "chart.png";
  Arguments arguments(
      "chart", "Draws columns of a table (CSV with a header) as lines, as points in groups, or as coloured cells.");
  arguments.option("TABLE", options.table, "file with the table (CSV)", Need::required);
  arguments.option("--x", options.x, "name of the column along the horizontal axis", Need::required);
  arguments.option("--y", options.y, "name of a column to draw; may be repeated", Need::required);
  arguments.option("--by", options.by, "points instead of lines, one colour for each value of this column");
  arguments.option("--where", options.where, "COLUMN=VALUE: only these lines, with --by or --heat; may be repeated");
  arguments.option("--faint", options.faint, "COLUMN=VALUE: groups to draw faintly, with --by");
  arguments.toggle("--front", options.front,
                   "with --by: the front of the points that no other point beats in both columns");
  arguments.option("--heat", options.heat,
                   "coloured cells instead of lines: the value of this column over --x and --y");
  arguments.option("--heat-label", options.heat_label, "with its unit; empty: the column's name");
  arguments.option("--heat-from", options.heat_from, "value of the first colour; without it, the least");
  arguments.option("--heat-to", options.heat_to, "value of the last colour; without it, the largest");
  arguments.option("--frontier", options.frontier, "with --heat: a line at this column's height over --x");
  arguments.option("--panels", options.panels,
                   "with --by or --heat: a picture for each value of this column, side by side");
  arguments.option("--mark-x", options.marks, "NAME=VALUE: a vertical line; may be repeated");
  arguments.toggle("--log-x", labels.log_x, "logarithmic horizontal axis");
  arguments.toggle("--log-y", labels.log_y, "logarithmic vertical axis");
  arguments.option("--title", labels.title, "title above the picture");
  arguments.option("--x-label", labels.x, "with its unit; empty: the column's name");
  arguments.option("--y-label", labels.y, "with its unit");
  arguments.toggle("--from-zero", labels.y_from_zero, "begin the vertical axis at 0");
  arguments.option("--out", picture, "picture to write (PNG)");
  if (!arguments.parse(argc, argv)) return 0;
  if (labels.x.empty()) labels.x = options.x;
  for (const std::string& mark : options.marks) {
    const auto [name, value] = split_at_equals("--mark-x", mark);
    labels.marks.push_back({number_or_nan(value), name});
  }
  write_png(picture, options.by.empty() && options.heat.empty() ? plot(labels, lines(options), kWidth_px, kHeight_px)
                     : options.panels.empty()                   ? chart_of_lines(options, labels)
                                                                : in_panels(options, labels));
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("chart", [&] { return sectio::run(argc, argv); });
}
