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

struct Wanted {
  std::string table, x, by, faint, panels, heat, heat_label, frontier;
  double heat_from = std::numeric_limits<double>::quiet_NaN(), heat_to = heat_from;
  std::vector<std::string> y, where, marks;
  bool front = false;
};

// The text before and behind the first "=".
std::pair<std::string, std::string> halves(const std::string& flag, const std::string& text) {
  const auto at = text.find('=');
  if (at == std::string::npos) throw InputError(flag + " " + text + ": expected NAME=VALUE");
  return {text.substr(0, at), text.substr(at + 1)};
}

// Lines that every --where accepts.
std::vector<bool> chosen(const Wanted& wanted) {
  std::vector<bool> is_chosen(read_text_column(wanted.table, wanted.x).size(), true);
  for (const std::string& where : wanted.where) {
    const auto [name, value] = halves("--where", where);
    const std::vector<std::string> column = read_text_column(wanted.table, name);
    for (std::size_t i = 0; i < column.size(); ++i) is_chosen[i] = is_chosen[i] && column[i] == value;
  }
  return is_chosen;
}

// In a column of words some cells may not be numbers: they are left out of the picture.
double number_or_nan(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end == text.c_str() + text.size() && !text.empty() ? value : std::numeric_limits<double>::quiet_NaN();
}

// A series for each value of the column `by`, in the order of the table, faint ones last.
std::vector<Series> groups(const Wanted& wanted) {
  const std::vector<bool> is_chosen = chosen(wanted);
  const auto x = read_text_column(wanted.table, wanted.x), y = read_text_column(wanted.table, wanted.y[0]),
             by = read_text_column(wanted.table, wanted.by);
  const auto faint = wanted.faint.empty() ? std::pair<std::string, std::string>() : halves("--faint", wanted.faint);
  const auto faint_column =
      wanted.faint.empty() ? std::vector<std::string>(x.size()) : read_text_column(wanted.table, faint.first);
  std::vector<Series> series;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double at_x = number_or_nan(x[i]), at_y = number_or_nan(y[i]);
    if (!std::isfinite(at_x) || !std::isfinite(at_y)) continue;
    auto of = std::find_if(series.begin(), series.end(), [&](const Series& s) { return s.name == by[i]; });
    if (of == series.end()) {
      series.push_back(
          {by[i], {}, {}, Series::Style::points, !wanted.faint.empty() && faint_column[i] == faint.second});
      of = series.end() - 1;
    }
    if (!is_chosen[i]) continue;  // a group has its colour, whichever lines are chosen
    of->x.push_back(at_x);
    of->y.push_back(at_y);
  }
  std::stable_partition(series.begin(), series.end(), [](const Series& s) { return !s.faint; });
  return series;
}

std::vector<Series> lines(const Wanted& wanted) {
  std::vector<std::string> names{wanted.x};
  names.insert(names.end(), wanted.y.begin(), wanted.y.end());
  const auto columns = read_columns(wanted.table, names);
  std::vector<Series> series;
  for (std::size_t i = 0; i < wanted.y.size(); ++i) series.push_back({wanted.y[i], columns[0], columns[i + 1]});
  return series;
}

constexpr int kWidth_px = 960, kHeight_px = 480, kHeightOfGroups_px = 560;

Image grouped(const Wanted& wanted, const ChartLabels& labels) {
  std::vector<Series> series = groups(wanted);
  if (wanted.front) series.push_back(front_of(series));
  return plot(labels, series, kWidth_px, kHeightOfGroups_px);
}

// Cells over x and y; the frontier is a height over x, the same in all lines with that x.
Image heated(const Wanted& wanted, const ChartLabels& labels) {
  const std::vector<bool> is_chosen = chosen(wanted);
  const auto x = read_text_column(wanted.table, wanted.x), y = read_text_column(wanted.table, wanted.y[0]),
             value = read_text_column(wanted.table, wanted.heat);
  const auto height =
      wanted.frontier.empty() ? std::vector<std::string>(x.size()) : read_text_column(wanted.table, wanted.frontier);
  HeatMap map;
  map.name = wanted.heat_label.empty() ? wanted.heat : wanted.heat_label;
  if (std::isfinite(wanted.heat_from)) map.low = wanted.heat_from;
  if (std::isfinite(wanted.heat_to)) map.high = wanted.heat_to;
  std::map<double, double> frontier;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!is_chosen[i]) continue;
    map.x.push_back(number_or_nan(x[i]));
    map.y.push_back(number_or_nan(y[i]));
    map.value.push_back(number_or_nan(value[i]));
    if (!wanted.frontier.empty()) frontier[map.x.back()] = number_or_nan(height[i]);
  }
  std::vector<Series> series;
  if (!wanted.frontier.empty()) series.push_back({wanted.frontier, {}, {}, Series::Style::dashes});
  for (const auto& [at_x, at_y] : frontier) {
    series[0].x.push_back(at_x);
    series[0].y.push_back(at_y);
  }
  return heat_map(labels, map, series, kWidth_px, kHeightOfGroups_px);
}

Image of_chosen(const Wanted& wanted, const ChartLabels& labels) {
  return wanted.heat.empty() ? grouped(wanted, labels) : heated(wanted, labels);
}

// One picture a value, two side by side.
Image in_panels(Wanted wanted, ChartLabels labels) {
  std::vector<std::string> values;
  for (const std::string& value : read_text_column(wanted.table, wanted.panels))
    if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
  Image all(2 * kWidth_px, static_cast<int>(values.size() + 1) / 2 * kHeightOfGroups_px, {255, 255, 255, 255});
  const std::vector<std::string> where = wanted.where;
  for (std::size_t i = 0; i < values.size(); ++i) {
    wanted.where = where;
    wanted.where.push_back(wanted.panels + "=" + values[i]);
    labels.title = values[i];
    paste(all, of_chosen(wanted, labels), static_cast<int>(i % 2) * kWidth_px,
          static_cast<int>(i / 2) * kHeightOfGroups_px);
  }
  return all;
}

int run(int argc, char** argv) {
  Wanted wanted;
  ChartLabels labels;
  std::string picture = "chart.png";
  Arguments arguments(
      "chart", "Draws columns of a table (CSV with a header) as lines, as points in groups, or as coloured cells.");
  arguments.option("TABLE", wanted.table, "file with the table (CSV)", Need::required);
  arguments.option("--x", wanted.x, "name of the column along the horizontal axis", Need::required);
  arguments.option("--y", wanted.y, "name of a column to draw; may be repeated", Need::required);
  arguments.option("--by", wanted.by, "points instead of lines, one colour for each value of this column");
  arguments.option("--where", wanted.where, "COLUMN=VALUE: only these lines, with --by or --heat; may be repeated");
  arguments.option("--faint", wanted.faint, "COLUMN=VALUE: groups to draw faintly, with --by");
  arguments.toggle("--front", wanted.front, "with --by: the front of points that no other beats in both columns");
  arguments.option("--heat", wanted.heat, "coloured cells instead of lines: the value of this column over --x and --y");
  arguments.option("--heat-label", wanted.heat_label, "with its unit; empty: the column's name");
  arguments.option("--heat-from", wanted.heat_from, "value of the first colour; without it, the least");
  arguments.option("--heat-to", wanted.heat_to, "value of the last colour; without it, the largest");
  arguments.option("--frontier", wanted.frontier, "with --heat: a line at this column's height over --x");
  arguments.option("--panels", wanted.panels,
                   "with --by or --heat: a picture for each value of this column, side by side");
  arguments.option("--mark-x", wanted.marks, "NAME=VALUE: a vertical line; may be repeated");
  arguments.toggle("--log-x", labels.log_x, "logarithmic horizontal axis");
  arguments.toggle("--log-y", labels.log_y, "logarithmic vertical axis");
  arguments.option("--title", labels.title, "above the picture");
  arguments.option("--x-label", labels.x, "with its unit; empty: the column's name");
  arguments.option("--y-label", labels.y, "with its unit");
  arguments.toggle("--from-zero", labels.y_from_zero, "the vertical axis begins at 0");
  arguments.option("--out", picture, "picture to write (PNG)");
  if (!arguments.parse(argc, argv)) return 0;
  if (labels.x.empty()) labels.x = wanted.x;
  for (const std::string& mark : wanted.marks) {
    const auto [name, value] = halves("--mark-x", mark);
    labels.marks.push_back({number_or_nan(value), name});
  }
  write_png(picture, wanted.by.empty() && wanted.heat.empty() ? plot(labels, lines(wanted), kWidth_px, kHeight_px)
                     : wanted.panels.empty()                  ? of_chosen(wanted, labels)
                                                              : in_panels(wanted, labels));
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("chart", [&] { return sectio::run(argc, argv); });
}
