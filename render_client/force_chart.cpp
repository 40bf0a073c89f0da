// A chart of the force at the hand over time, from logs of device_bridge.
#include <filesystem>

#include "common/core/arguments.h"
#include "common/math/types.h"
#include "render_client/output/chart.h"
#include "render_client/output/png.h"
#include "render_client/output/table.h"

namespace sectio {
namespace {

Series read_force(const std::string& path) {
  const auto columns = read_columns(path, {"time_s", "force_x_world_n", "force_y_world_n", "force_z_world_n"});
  Series series{std::filesystem::path(path).stem().string(), columns[0], {}};
  for (std::size_t i = 0; i < series.x.size(); ++i)
    series.y.push_back(Vec3(columns[1][i], columns[2][i], columns[3][i]).norm());
  return series;
}

int run(int argc, char** argv) {
  std::vector<std::string> logs;
  std::string picture = "force.png";
  Arguments arguments("force_chart", "Draws the force at the hand over time, from logs of device_bridge.");
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
