// Windows that a knife cuts out of plates of any size and tissue, along a ring or a square with round corners, which
// may be rounder or sharper than an element.
#include <cmath>
#include <sstream>

#include "tests/robustness/fresh_scenes.h"

namespace sectio::test {
namespace {

constexpr double kPlate_m = 0.05;       // the plate hangs so far above the floor,
constexpr double kPlateSag_m = 0.004;   // and sags by so much
constexpr double kBelowPlate_m = 0.02;  // the knife reaches so far below it
constexpr double kOverlap_m = 0.004, kLift_m_per_s = 0.1;

// A square whose corners are arcs; a ring when these are as large as half its side.
struct Window {
  double half_side_m, corner_m;

  double straight_m() const { return 2 * (half_side_m - corner_m); }
  double quarter_m() const { return straight_m() + 0.5 * M_PI * corner_m; }
  double length_m() const { return 4 * quarter_m(); }
  double area_m2() const { return 4 * half_side_m * half_side_m - (4 - M_PI) * corner_m * corner_m; }

  struct Place {
    Vec3 at_m, ahead;
  };
  // A quarter goes from the middle of the side at +x to that of the side at +y.
  Place at(double way_m) const {
    const double quarter = std::floor(way_m / quarter_m()), on_m = way_m - quarter * quarter_m(),
                 half_m = 0.5 * straight_m(), turn_rad = (on_m - half_m) / corner_m;
    const Vec3 corner(half_m, half_m, 0);
    Place place{Vec3(half_side_m, on_m, 0), Vec3::UnitY()};
    if (turn_rad > 0.5 * M_PI)
      place = {Vec3(quarter_m() - on_m, half_side_m, 0), -Vec3::UnitX()};
    else if (turn_rad > 0)
      place = {corner + corner_m * Vec3(std::cos(turn_rad), std::sin(turn_rad), 0),
               Vec3(-std::sin(turn_rad), std::cos(turn_rad), 0)};
    const Eigen::AngleAxisd turned(quarter * 0.5 * M_PI, Vec3::UnitZ());
    return {turned * place.at_m, turned * place.ahead};
  }
};

// Down, around, and out again.
std::vector<TracePoint> round_stroke(const Window& window, const Vec3& middle_m, double begins_rad, double height_m,
                                     double speed_m_per_s) {
  constexpr double kPlace_m = 5e-4;
  const Eigen::AngleAxisd turned(begins_rad, Vec3::UnitZ());
  const Vec3 up = (height_m + kBelowPlate_m + 0.01) * Vec3::UnitZ();
  const auto pose = [&](double way_m, const Vec3& above_m) {
    const auto [at_m, ahead] = window.at(way_m);
    return held(middle_m + turned * at_m + above_m - kBelowPlate_m * Vec3::UnitZ(), Vec3::UnitZ(), turned * ahead);
  };
  const double way_m = window.length_m() + kOverlap_m, moves_s = up.norm() / kLift_m_per_s;
  std::vector<TracePoint> trace{{0, pose(0, up), 0}, {0.3, pose(0, up), 0}};
  double time_s = 0.3 + moves_s;
  for (double gone_m = 0; gone_m < way_m; gone_m += kPlace_m, time_s += kPlace_m / speed_m_per_s)
    trace.push_back({time_s, pose(gone_m, Vec3::Zero()), 0});
  trace.push_back({time_s, pose(way_m, Vec3::Zero()), 0});
  trace.push_back({time_s + moves_s, pose(way_m, up), 0});
  return trace;
}

std::string make_window(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double length_m = numbers.between(0.06, 0.1), width_m = numbers.between(0.05, 0.08),
               height_m = numbers.between(0.008, 0.02);
  Window window{};
  window.half_side_m = numbers.between(0.01, std::min(0.016, 0.5 * width_m - 0.008));
  window.corner_m = numbers.one_of(std::array{numbers.between(0.002, 0.006), window.half_side_m});
  const Vec3 middle_m(0.1 * length_m, 0, kPlate_m);
  const double held_to_m = middle_m.x() - 1.5 * window.half_side_m, hangs_m = length_m / 2 - held_to_m;
  VolumeKeys keys{numbers.one_of(std::array{"neo_hookean", "tetra_springs", "neo_hookean_lattice"}), "rigid",
                  static_cast<int>(numbers.between(2500, 6000))};
  keys.young_pa = std::max(std::pow(10, numbers.between(4.6, 5.2)), young_pa_of_sag(hangs_m, height_m, kPlateSag_m));
  keys.material = ", toughness_j_per_m2: 15";
  const double speed_m_per_s = std::pow(10, numbers.between(-1.5, -0.3)), begins_rad = numbers.between(0, 2 * M_PI);

  TriangleSoup plate = box(1, 1, 1, Vec3(length_m, width_m, height_m));
  for (Vec3& x : plate.vertices_body_m) x += Vec3(-length_m / 2, -width_m / 2, kPlate_m);
  const auto trace = round_stroke(window, middle_m, begins_rad, height_m, speed_m_per_s);
  leave_files(directory, plate, trace);
  const double freed_ml = 1e6 * window.area_m2() * height_m;
  leave_scene(directory, {.session = "window_" + std::to_string(seed),
                          .expect = about_freed(freed_ml),
                          .body = keys,
                          .held_to_m = held_to_m,
                          .duration_s = trace.back().time_s + 0.5,
                          .shaft_m = 0.08,
                          .edge_m = 0.06,
                          .sharp_m = 0.06});
  std::ostringstream words;
  words << 2e3 * window.half_side_m << " mm, corners of " << 1e3 * window.corner_m << " mm, in " << 1e3 * height_m
        << " mm, " << 1e3 * speed_m_per_s << " mm/s\n"
        << keys.text();
  return words.str();
}

TEST(FreshWindows, come_out_of_plates) {
  play(make_window, 6);
}

}  // namespace
}  // namespace sectio::test
