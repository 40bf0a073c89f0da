// The force at the hand over time, as a picture, out of the logs that device_bridge wrote.
#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/math/types.h"
#include "render_client/output/chart.h"
#include "render_client/output/png.h"

namespace sectio {
namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

std::size_t column(const std::string& path, const std::vector<std::string>& header, const std::string& name) {
  const auto found = std::find(header.begin(), header.end(), name);
  if (found == header.end()) throw InputError(path + ":1: no column " + name);
  return static_cast<std::size_t>(found - header.begin());
}

double number(const std::string& path, std::size_t line, const std::vector<std::string>& cells, std::size_t at) {
  double value = 0;
  const std::string& text = at < cells.size() ? cells[at] : "";
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(path + ":" + std::to_string(line) + ": expected a number, got '" + text + "'");
  return value;
}

// Columns are found by their names; throws InputError with the line of what can't be read.
Series read_force(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) throw InputError(path + ": can't be read, or is empty");
  const std::vector<std::string> header = cells_of(line);
  const std::size_t time = column(path, header, "time_s");
  std::array<std::size_t, 3> force{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    force[axis] = column(path, header, std::string("force_") + "xyz"[axis] + "_world_n");
  Series series{std::filesystem::path(path).stem().string(), {}, {}};
  for (std::size_t n = 2; std::getline(file, line); ++n) {
    const std::vector<std::string> cells = cells_of(line);
    const Vec3 f(number(path, n, cells, force[0]), number(path, n, cells, force[1]), number(path, n, cells, force[2]));
    series.x.push_back(number(path, n, cells, time));
    series.y.push_back(f.norm());
  }
  return series;
}

int run(int argc, char** argv) {
  std::vector<std::string> logs;
  std::string picture = "force.png";
  Arguments arguments("force_chart", "Draws the force at the hand over time, out of logs of device_bridge.");
  arguments.option("--log", logs, "log of a bridge (CSV); may be repeated", Need::required);
  arguments.option("--out", picture, "picture to write (PNG)");
  if (!arguments.parse(argc, argv)) return 0;
  std::vector<Series> series;
  series.reserve(logs.size());
  for (const std::string& log : logs) series.push_back(read_force(log));
  write_png(picture, plot({"Force at the hand", "time / s", "force / N"}, series));
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("force_chart", [&] { return sectio::run(argc, argv); });
}
