// Bars of any size and tissue, which a knife cuts right through, with one stroke at any angle and speed.
#include <cmath>
#include <sstream>

#include "tests/robustness/fresh_scenes.h"

namespace sectio::test {
namespace {

constexpr double kBarSag_m = 0.012;    // at the end of a bar that is held at its other end
constexpr double kBelowBar_m = 0.035;  // the knife reaches so far below the bar, which sags
constexpr int kPoints = 120;

// Leans to the side on which the bar goes on, and goes across it.
std::vector<TracePoint> stroke(const Vec3& through_m, double heading_rad, double lean_rad, double reach_m,
                               double below_m, double speed_m_per_s) {
  const Vec3 ahead(-std::sin(heading_rad), std::cos(heading_rad), 0),
      along(std::cos(heading_rad), std::sin(heading_rad), 0);
  const Vec3 shaft = std::sin(lean_rad) * along + std::cos(lean_rad) * Vec3::UnitZ();
  const Vec3 tip = through_m - below_m / std::cos(lean_rad) * shaft;
  std::vector<TracePoint> trace;
  for (int k = 0; k <= kPoints; ++k) {
    const double way_m = 2 * reach_m * k / kPoints;
    trace.push_back({0.2 + way_m / speed_m_per_s, held(tip + (way_m - reach_m) * ahead, shaft, ahead), 0});
  }
  return trace;
}

struct Bar {
  double length_m, width_m, height_m, above_m;  // the last: above z = 0
  double cut_at_m, held_to_m, floor_z_m;        // along the bar, from its middle; and along z
  bool comes_apart = true;
};

// Leaves the files of a run in which the bar's end is to come off, and describes it.
std::string leave_bar(const std::string& directory, const std::string& session, const Bar& bar, const VolumeKeys& keys,
                      const std::vector<TracePoint>& trace, double speed_m_per_s, const std::string& expect = {}) {
  TriangleSoup mesh = box(1, 1, 1, Vec3(bar.length_m, bar.width_m, bar.height_m));
  mesh = moved(std::move(mesh), Vec3(-bar.length_m / 2, -bar.width_m / 2, bar.above_m));
  leave_files(directory, mesh, trace);
  const double freed_ml = 1e6 * (bar.length_m / 2 - bar.cut_at_m) * bar.width_m * bar.height_m;
  leave_scene(directory, {.session = session,
                          .expect = "incisions: 1, " +
                                    (bar.comes_apart ? about_freed(freed_ml) : std::string("pieces_freed: 0")) + expect,
                          .body = keys,
                          .held_to_m = bar.held_to_m,
                          .floor_z_m = bar.floor_z_m,
                          .duration_s = trace.back().time_s + 1.2,
                          .shaft_m = 0.13,
                          .edge_m = 0.126,
                          .sharp_m = 0.12});
  std::ostringstream words;
  words << 1e3 * bar.length_m << " x " << 1e3 * bar.width_m << " x " << 1e3 * bar.height_m << " mm, "
        << 1e3 * bar.above_m << " mm above 0, " << 1e3 * speed_m_per_s << " mm/s\n"
        << keys.text();
  return words.str();
}

std::string make_bar(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double length_m = numbers.between(0.06, 0.14), width_m = numbers.between(0.015, 0.04),
               height_m = numbers.between(0.012, 0.035);
  const bool lies = numbers.between(0, 1) < 0.3;  // on the floor
  const double hangs_m = lies ? 0.02 : 0.85 * length_m;
  const double young_pa =
      std::max(std::pow(10, numbers.between(3.7, 5)), young_pa_of_sag(hangs_m, height_m, kBarSag_m));
  const double speed_m_per_s = std::pow(10, numbers.between(-1.5, 0.3));
  const double cut_at_m = numbers.between(-0.15, 0.15) * length_m, heading_rad = numbers.between(-0.6, 0.6),
               lean_rad = numbers.between(-0.25, 0.25);
  VolumeKeys keys{numbers.one_of(std::array{"neo_hookean", "tetra_springs", "neo_hookean_lattice"}), {}, 0, young_pa};
  keys.cutting = std::string(", style: ") + numbers.one_of(std::array{"progressive", "semi_progressive"});
  keys.free_parts = numbers.one_of(std::array{"deformable", "rigid"});
  keys.tetrahedra = static_cast<int>(numbers.between(1000, 6000));

  const double above_m = lies ? 0 : 0.05;
  const auto trace = stroke(Vec3(cut_at_m, 0, above_m + height_m / 2), heading_rad, lean_rad,
                            width_m / 2 / std::cos(heading_rad) + height_m * std::abs(std::tan(lean_rad)) + 0.02,
                            height_m / 2 + (lies ? 0.004 : kBelowBar_m), speed_m_per_s);
  const Bar bar{length_m, width_m, height_m, above_m, cut_at_m, -0.35 * length_m, lies ? -0.0005 : 0};
  return leave_bar(directory, "bar_" + std::to_string(seed), bar, keys, trace, speed_m_per_s);
}

// Soft and thick, close above the floor: while it is cut, the half that sinks to the floor slides along the stump.
std::string make_sliding_bar(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double length_m = numbers.between(0.07, 0.1), width_m = numbers.between(0.025, 0.045),
               height_m = numbers.between(0.025, 0.035), above_m = numbers.between(0.01, 0.02);
  const double speed_m_per_s = numbers.between(0.02, 0.06), cut_at_m = numbers.between(-0.05, 0.1) * length_m;
  const char* model = numbers.one_of(std::array{"neo_hookean", "tetra_springs", "neo_hookean_lattice"});
  VolumeKeys keys{model, {}, 0, numbers.between(9000, 16000)};
  keys.free_parts = "deformable";
  keys.tetrahedra = static_cast<int>(numbers.between(1500, 4000));
  const auto trace = stroke(Vec3(cut_at_m, 0, above_m + height_m / 2), 0, 0, width_m / 2 + 0.02,
                            height_m / 2 + above_m + 0.005, speed_m_per_s);
  const Bar bar{length_m, width_m, height_m, above_m, cut_at_m, -0.3 * length_m, 0};
  return leave_bar(directory, "sliding_bar_" + std::to_string(seed), bar, keys, trace, speed_m_per_s);
}

// The lips of a cut that goes around a bar measure as much as the plane's section with its skin.
std::string make_bar_with_lips(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double length_m = 0.08, width_m = 0.02, height_m = 0.02, above_m = 0.05;
  const double cut_at_m = numbers.between(-0.004, 0.012), heading_rad = numbers.between(-0.15, 0.15);
  const double speed_m_per_s = std::pow(10, numbers.between(-1.2, -0.5));
  VolumeKeys keys{numbers.one_of(std::array{"neo_hookean", "tetra_springs"}), "rigid", 0, 60000};
  keys.tetrahedra = static_cast<int>(numbers.between(1500, 4000));
  const auto trace = stroke(Vec3(cut_at_m, 0, above_m + height_m / 2), heading_rad, 0,
                            width_m / 2 / std::cos(heading_rad) + 0.02, height_m / 2 + 0.015, speed_m_per_s);
  const Bar bar{length_m, width_m, height_m, above_m, cut_at_m, -0.01, 0};
  return leave_bar(directory, "bar_with_lips_" + std::to_string(seed), bar, keys, trace, speed_m_per_s,
                   ", cut_m: " + about(2 * (width_m / std::cos(heading_rad) + height_m), 0.035));
}

// A knife passes above the underside of a bar that lies on the floor: a hole there would have a rim of its own.
std::string make_bar_over_wall(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double length_m = 0.07, width_m = numbers.between(0.03, 0.05), height_m = numbers.between(0.018, 0.028);
  const double left_m = numbers.between(0.0005, 0.001), speed_m_per_s = numbers.between(0.04, 0.12);
  VolumeKeys keys{numbers.one_of(std::array{"neo_hookean", "tetra_springs", "neo_hookean_lattice"}), "rigid", 0, 30000};
  keys.tetrahedra = static_cast<int>(numbers.between(1500, 4000));
  const auto trace = stroke(Vec3(0, 0, height_m / 2), 0, 0, width_m / 2 + 0.015, height_m / 2 - left_m, speed_m_per_s);
  const Bar bar{length_m, width_m, height_m, 0, 0, -0.3 * length_m, 0, false};
  return leave_bar(directory, "bar_over_wall_" + std::to_string(seed), bar, keys, trace, speed_m_per_s,
                   ", cut_m: " + about(width_m + 2 * height_m, 0.17));
}

TEST(FreshBars, keep_the_far_wall_of_a_knife_that_passes_above_it) {
  play(make_bar_over_wall, 8, 81000);  // elements of 81001 and 81006 reach beneath the knife
}

TEST(FreshBars, come_apart_where_a_knife_goes_through) {
  play(make_bar, 6);
}

TEST(FreshBars, have_one_lip_on_each_side_of_a_cut) {
  play(make_bar_with_lips, 12);
}

TEST(FreshBars, stay_out_of_the_half_that_slides_along_them) {
  play(make_sliding_bar, 4);
}

}  // namespace
}  // namespace sectio::test
