// Columns of a table against another one, as a picture.
#include "common/core/arguments.h"
#include "render_client/output/chart.h"
#include "render_client/output/png.h"
#include "render_client/output/table.h"

namespace sectio {
namespace {

int run(int argc, char** argv) {
  std::string table, x, picture = "chart.png", title, x_label, y_label;
  std::vector<std::string> y;
  bool from_zero = false;
  Arguments arguments("chart", "Draws columns of a table (CSV with a header) as lines.");
  arguments.option("TABLE", table, "file with the table (CSV)", Need::required);
  arguments.option("--x", x, "name of the column along the horizontal axis", Need::required);
  arguments.option("--y", y, "name of a column to draw; may be repeated", Need::required);
  arguments.option("--title", title, "above the picture");
  arguments.option("--x-label", x_label, "with its unit; empty: the column's name");
  arguments.option("--y-label", y_label, "with its unit");
  arguments.toggle("--from-zero", from_zero, "the vertical axis begins at 0");
  arguments.option("--out", picture, "picture to write (PNG)");
  if (!arguments.parse(argc, argv)) return 0;
  std::vector<std::string> names{x};
  names.insert(names.end(), y.begin(), y.end());
  const auto columns = read_columns(table, names);
  std::vector<Series> series;
  for (std::size_t i = 0; i < y.size(); ++i) series.push_back({y[i], columns[0], columns[i + 1]});
  write_png(picture, plot({title, x_label.empty() ? x : x_label, y_label, from_zero}, series));
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("chart", [&] { return sectio::run(argc, argv); });
}
