// Prints how true the force at the hand is, and how quiet: the tables of docs/haptics.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/formatted.h"
#include "sim_server/engine/standard_traits.h"
#include "tests/feel/felt_motions.h"

namespace sectio::test {
namespace {

struct Tissue {
  const char* name;
  const char* model;
  double young_pa;
  double depth_m;
};
constexpr Tissue kTissues[] = {
    {"surface_springs      6 kPa", "surface_springs", 6e3, 0.003},
    {"neo_hookean          6 kPa", "neo_hookean", 6e3, 0.003},
    {"neo_hookean_lattice  6 kPa", "neo_hookean_lattice", 6e3, 0.003},
    {"neo_hookean_lattice 60 kPa", "neo_hookean_lattice", 6e4, 0.003},
    {"neo_hookean_lattice 300 kPa", "neo_hookean_lattice", 3e5, 0.001},
};

void print_sines(const DeviceLimits& device) {
  std::puts("Error of what varies in the force, % (of the whole force, %), of sines of 1, 3, 10, 30, 60 Hz");
  for (const Tissue& t : kTissues) {
    std::printf("%-28s", t.name);
    std::array<std::string, 3> cells;
    for (const Sine& sine : kSines) {
      const auto felt =
          felt_on_path(felt_block(t.model, t.young_pa), pressing(t.depth_m, sine), kSinesFor_s, kWires, device);
      for (std::size_t w = 0; w < felt.size(); ++w) {
        const FeltError e = error_of(felt[w], kSettled_s);
        cells[w] += formatted(" %5.1f (%.1f, %.0f)", 100 * e.varying, 100 * e.whole, 100 * e.sideways);
      }
    }
    for (const std::string& cell : cells) std::printf(" |%s", cell.c_str());
    std::puts("");
    std::fflush(stdout);
  }
}

void print_taps() {
  std::puts("Taps of 3 mm at 50 mm/s: late, ms, error of the whole force, %, largest error, mN");
  for (const Tissue& t : kTissues) {
    std::printf("%-28s", t.name);
    for (const auto& felt : felt_on_path(felt_block(t.model, t.young_pa), tap(t.depth_m, 0.05), 0.6, kWires)) {
      double most = 0, peak = 0;
      for (const FeltTick& tick : felt) {
        most = std::max(most, std::abs((tick.felt_n - tick.truth_n).z()));
        peak = std::max(peak, tick.truth_n.z());
      }
      std::printf(" | %5.1f  %5.1f  %6.1f of %.0f", 1e3 * late_s(felt, 0.05 * peak), 100 * error_of(felt, 0).whole,
                  1e3 * most, 1e3 * peak);
    }
    std::puts("");
    std::fflush(stdout);
  }
}

void print_holds() {
  std::puts("Held: ripple, N, and energy to the hand, mJ/s (before 2 s: rises)");
  for (const bool weak : {false, true}) {
    for (const char* model : {"surface_springs", "neo_hookean_lattice"}) {
      for (const double young_pa : {1e3, 6e3, 6e4, 3e5}) {
        std::printf("%s hand, %-20s %5.0f kPa", weak ? "weak" : "firm", model, young_pa / 1e3);
        for (const WireSpec& wire : kWires) {
          const auto felt = felt_in_loop(felt_block(model, young_pa), holding(young_pa > 1e5 ? 0.001 : 0.003), 4, wire,
                                         weak ? kWeakHand : kFirmHand);
          const FeltHold hold = hold_of(felt, 2);
          std::printf(" | %.4f  %7.4f (%.3f)", hold.ripple_n, 1e3 * hold.power_w, felt.back().felt_n.norm());
        }
        std::puts("");
        std::fflush(stdout);
      }
    }
  }
}

void print_blades() {
  std::puts("A blade 8 mm deep that has cut 10 mm, held: ripple, N, energy to the hand, mJ/s, force, N");
  for (const char* model : {"surface_springs", "neo_hookean_lattice"}) {
    for (const double young_pa : {1e3, 6e3, 6e4, 3e5}) {
      for (const bool trembles : {false, true}) {
        std::printf("%-20s %3.0f kPa%s", model, young_pa / 1e3, trembles ? ", trembling" : "");
        for (const WireSpec& wire : kWires) {
          const auto felt = felt_in_loop(blade_block(model, young_pa), cutting_and_holding(), 4, wire,
                                         trembles ? kTremblingHand : kFirmHand);
          const FeltHold hold = hold_of(felt, 2.5);
          std::printf(" | %.4f  %7.4f (%.3f)", hold.ripple_n, 1e3 * hold.power_w, felt.back().felt_n.norm());
        }
        std::puts("");
        std::fflush(stdout);
      }
    }
  }
}

void print_grip(const char* what, const Scene& scene, std::uint32_t tool, double from_s, double to_s, bool is_late) {
  for (const bool weak : {false, true}) {
    std::printf("%-28s%s", what, weak ? ", weak hand" : "           ");
    for (const WireSpec& wire : kGripWires) {
      const auto felt = felt_in_scene(scene, tool, to_s, wire, weak ? kWeakHand : kFirmHand, is_late);
      const FeltHold hold = hold_of(felt, from_s);
      std::printf(" | %.4f  %7.4f (%.3f)", hold.ripple_n, 1e3 * hold.power_w, felt.back().felt_n.norm());
    }
    std::puts("");
    std::fflush(stdout);
  }
}

void print_grips() {
  std::puts("Held by jaws, 0, 10, 25, 50 ms: ripple, N, energy to the hand, mJ/s, force, N");
  for (const Tissue& t : kTissues)
    print_grip(t.name, gripped_block(t.model, t.young_pa), 0, kGripped_s, kLifts_s, false);
  const Lift lift =
      lifting(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/exercise_tumour.yaml", standard_traits()), 1, 0.1);
  const double from_s = lift.closed_s + 0.5, to_s = lift.closed_s + kHoldFor_s;
  print_grip("a piece in its bed", lift.scene, 1, from_s, to_s, false);
  print_grip("the same, the bed is spared", lift.scene, 1, from_s, to_s, true);
}

void write_motions(const std::string& file) {
  struct Motion {
    const char* name;
    Path path;
    double duration_s;
    const char* tool;
  };
  std::ofstream out(file);
  double from_s = 0;
  out << "motion,time_s,true,felt at 0 ms,felt at 25 ms\n";
  for (const Motion& m : {Motion{"tap", tap(0.003, 0.05), 0.5, "probe"},
                          {"slide", sliding(0.002, 0.02), 1.6, "probe"},
                          {"cut", cutting(0.02), 1.6, "scalpel"}}) {
    const bool cuts = m.tool == std::string("scalpel");
    const Scene scene = cuts ? blade_block("neo_hookean_lattice", 6e3) : felt_block("neo_hookean_lattice", 6e3, m.tool);
    const auto felt = felt_on_path(scene, m.path, m.duration_s, kWires);
    for (std::size_t i = 0; i < felt[0].size(); ++i)
      out << m.name << ',' << from_s + felt[0][i].time_s << ',' << felt[0][i].truth_n.norm() << ','
          << felt[0][i].felt_n.norm() << ',' << felt[1][i].felt_n.norm() << '\n';
    from_s += m.duration_s;
  }
  if (!out.flush()) throw InputError(file + ": can't be written");
}

int run(int argc, char** argv) {
  std::vector<std::string> tables;
  std::string motions;
  DeviceLimits device;
  Arguments arguments("feel_tables",
                      "Prints how true and how quiet the force at a hand is, for wires of 0, 25, 50 ms.");
  arguments.option("--table", tables, "sines, taps, holds, blades or grips; all when not given");
  arguments.option("--motions", motions, "CSV file to write instead: a tap, a slide and a cut, felt and true");
  arguments.option("--damping", device.damping_n_s_per_m, "the device's own, N s/m, for the table of sines");
  if (!arguments.parse(argc, argv)) return 0;
  if (!motions.empty()) return write_motions(motions), 0;
  const auto wanted = [&](const char* name) {
    return tables.empty() || std::ranges::find(tables, name) != tables.end();
  };
  if (wanted("sines")) print_sines(device);
  if (wanted("taps")) print_taps();
  if (wanted("holds")) print_holds();
  if (wanted("blades")) print_blades();
  if (wanted("grips")) print_grips();
  return 0;
}

}  // namespace
}  // namespace sectio::test

int main(int argc, char** argv) {
  return sectio::run_program("feel_tables", [&] { return sectio::test::run(argc, argv); });
}
