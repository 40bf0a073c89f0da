// Prints what a blade costs the hand that moves it: the table of docs/haptics.md.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "tests/feel/blade_work.h"

namespace sectio::test {
namespace {

const BladeTissue kTissues[] = {
    {"surface_springs, 5 mm", "surface_springs"},
    {"surface_springs, 2.5 mm", "surface_springs", "progressive", 4},
    {"surface_springs, templates", "surface_springs", "templates"},
    {"tetra_springs, 2000", "tetra_springs", "progressive", 2, 2000},
    {"neo_hookean, 2000", "neo_hookean", "progressive", 2, 2000},
    {"neo_hookean, 6000", "neo_hookean", "progressive", 2, 6000},
    {"neo_hookean_lattice, 5 mm", "neo_hookean_lattice", "progressive", 2, 2000, 0.005},
    {"neo_hookean_lattice, 3 mm", "neo_hookean_lattice", "progressive", 2, 4000, 0.003},
};

void print(const BladeTissue& tissue, const BladeStroke& stroke, double speed_m_per_s, bool legs) {
  std::printf("%-27s %-8s %5.0f", tissue.name.c_str(), stroke.name.c_str(), 1e3 * speed_m_per_s);
  std::fflush(stdout);
  const std::vector<LegWork> done = work_of(tissue, stroke, speed_m_per_s);
  double area_m2 = 0, cut_j = 0, free_j = 0, booked_j = 0, most_free_j = 0;
  for (const LegWork& d : done) {
    area_m2 += d.leg.new_area_m2;
    (d.leg.new_area_m2 > 0 ? cut_j : free_j) += d.work_j;
    if (d.leg.new_area_m2 == 0) most_free_j = std::max(most_free_j, std::abs(d.work_j));
    booked_j += d.booked_j;
  }
  const double due_j = kToughness_j_per_m2 * area_m2;
  const auto steady = std::ranges::find_if(done, [](const LegWork& d) { return d.leg.is_steady; });
  std::printf("  %6.1f  %5.2f  %6.3f  %6.3f  %5.2f", 1e3 * due_j, cut_j / due_j, free_j / due_j, most_free_j / due_j,
              booked_j / (cut_j + free_j));
  if (steady != done.end() && steady->mean_n > 0)
    std::printf("  %5.1f %%  %.2f N", 100 * steady->ripple_n / steady->mean_n, steady->mean_n);
  std::puts("");
  for (const LegWork& d : done)
    if (legs)
      std::printf("    %-8s due %6.2f mJ, done %6.2f, booked %6.2f, %.3f N +- %.3f\n", d.leg.name.c_str(),
                  1e3 * kToughness_j_per_m2 * d.leg.new_area_m2, 1e3 * d.work_j, 1e3 * d.booked_j, d.mean_n,
                  d.ripple_n);
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  std::vector<std::string> only;
  bool legs = false;
  std::vector<std::string> strokes;
  Arguments arguments("blade_tables", "Prints the work of a hand with a blade over toughness times new area.");
  arguments.option("--only", only, "tissues whose names contain this; all when not given");
  arguments.option("--stroke", strokes, "slide, plunge, through or put back; all when not given");
  arguments.toggle("--legs", legs, "a line for each leg, too");
  if (!arguments.parse(argc, argv)) return 0;
  std::puts("tissue                      stroke    mm/s  due mJ  cut/due  free/due  most  booked/done  ripple  mean");
  for (const BladeTissue& tissue : kTissues) {
    const auto named = [&](const std::string& part) { return tissue.name.find(part) != std::string::npos; };
    if (!only.empty() && std::ranges::none_of(only, named)) continue;
    for (const double speed : {0.001, 0.01, 0.1, 0.5}) {
      const bool slow = speed < 0.005, is_whole = tissue.model != "surface_springs";
      for (const BladeStroke& stroke : {slow ? slide_and_return(0.004, 0.012) : slide_and_return(0.008, 0.03),
                                        plunge(slow ? 0.006 : 0.012), right_through(), put_back()}) {
        if (stroke.tool == "knife" && (slow || !is_whole)) continue;  // it takes long; a surface has no inside
        if (strokes.empty() || std::ranges::find(strokes, stroke.name) != strokes.end())
          print(tissue, stroke, speed, legs);
      }
    }
  }
  return 0;
}

}  // namespace
}  // namespace sectio::test

int main(int argc, char** argv) {
  return sectio::run_program("blade_tables", [&] { return sectio::test::run(argc, argv); });
}
