// Error laws from the chart's table.
#include <cstdio>
#include <fstream>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "sim_server/planning/error_law.h"

namespace {

int run(int argc, char** argv) {
  using namespace sectio;
  std::string chart, out;
  Arguments arguments("fit_laws", "fits the planner's error laws to the chart's table");
  arguments.option("CHART", chart, "chart.csv", Need::required);
  arguments.option("--out", out, "file for the laws; empty: they are printed");
  if (!arguments.parse(argc, argv)) return 0;
  std::ifstream in(chart);
  if (!in) throw InputError(chart + ": can't be read");
  const auto points = planning::read_chart({std::istreambuf_iterator<char>(in), {}});
  const std::string text = planning::to_text(planning::fit_laws(points));
  if (out.empty()) std::fputs(text.c_str(), stdout);
  if (!out.empty() && !(std::ofstream(out) << text).flush()) throw InputError(out + ": can't be written");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sectio::run_program("fit_laws", [&] { return run(argc, argv); });
}
