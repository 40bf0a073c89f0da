// Pads of skin that are cut beside a rim.
#include <sstream>

#include "tests/robustness/fresh_scenes.h"

namespace sectio::test {
namespace {

constexpr double kHalfLength_m = 0.04, kHalfWidth_m = 0.03, kHalfHeight_m = 0.006;
constexpr double kOverPad_m = 0.012, kToPad_s = 0.3;

enum class Stroke : std::uint8_t { along_a_rim, from_rim_to_rim };

std::string make_pad(std::uint64_t seed, Stroke stroke, const std::string& directory) {
  Numbers numbers(seed);
  const bool is_along = stroke == Stroke::along_a_rim;
  const double depth_m = numbers.between(0.0045, 0.006), speed_m_per_s = numbers.between(0.01, 0.06),
               young_pa = numbers.between(12e3, 25e3), aside = numbers.between(-0.08, 0.08);
  // Nearer to the rim than deep; or all over the pad, and beyond it.
  const double y_m =
      is_along ? numbers.between(0.001, 0.0025) - kHalfWidth_m : numbers.between(-0.6, 0.6) * kHalfWidth_m;
  const double half_m = is_along ? numbers.between(0.01, 0.022) : kHalfLength_m + 0.01;
  const Mat3 turned = Eigen::AngleAxisd(numbers.one_of(std::array{0.0, M_PI}), Vec3::UnitZ()).toRotationMatrix();
  std::vector<TracePoint> trace;
  const auto go = [&](double x_m, double above_m, double takes_s) {
    const Vec3 tip_m(x_m, y_m, kHalfHeight_m + above_m), shaft = Vec3(0, aside, 1).normalized();
    const double time_s = trace.empty() ? 0.1 : trace.back().time_s + takes_s;
    trace.push_back({time_s, held(turned * tip_m, turned * shaft, turned * Vec3::UnitX()), 0});
  };
  go(-half_m, kOverPad_m, 0);
  go(-half_m, -depth_m, kToPad_s);
  go(half_m, -depth_m, 2 * half_m / speed_m_per_s);
  go(half_m, kOverPad_m, kToPad_s);

  // Over rims, the faces of both ends are open as deep as the blade went.
  const double least_m = is_along ? 1.7 * half_m - 0.002 : 2 * kHalfLength_m + 1.6 * depth_m,
               most_m = is_along ? 3.2 * half_m + 0.005 : 2 * kHalfLength_m + 3 * depth_m;
  leave_files(directory, box(32, 24, 5, Vec3(2 * kHalfLength_m, 2 * kHalfWidth_m, 2 * kHalfHeight_m)), trace);
  std::ostringstream body;
  body << "    material: {young_pa: " << young_pa
       << ", poisson: 0.45, density_kg_per_m3: 1050, foundation_radius_m: 0.03, pretension: 0.1, damping_per_s: 30}\n"
       << "    cutting: {threshold_force_n: 0.06}\n";
  std::ofstream(directory + "/scene.yaml")
      << "session: rim_" << seed << "\nstep_s: auto\nduration_s: " << trace.back().time_s + 0.3
      << "\nexpect: {incisions: 1, pieces_freed: 0, cut_m: " << least_m << " to " << most_m << R"(}
camera: {eye_world_m: [0.09, -0.14, 0.13], target_world_m: [0, 0, 0], field_of_view_deg: 32}
bodies:
  - name: pad
    mesh: {file: body.obj, unit: m}
    pose: {position_world_m: [)"
      << -kHalfLength_m << ", " << -kHalfWidth_m << ", " << -kHalfHeight_m << "]}\n"
      << body.str() << "    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, " << -0.7 * kHalfHeight_m << R"(]}
tools:
  - {name: scalpel, kind: scalpel, trace: hand.csv}
)";
  std::ostringstream words;
  words << "at y = " << 1e3 * y_m << " mm, " << 1e3 * depth_m << " mm deep, " << 2e3 * half_m << " mm long, "
        << 1e3 * speed_m_per_s << " mm/s\n"
        << body.str();
  return words.str();
}

void play_pads(Stroke stroke) {
  play([&](std::uint64_t seed, const std::string& directory) { return make_pad(seed, stroke, directory); }, 8);
}

TEST(FreshPads, are_cut_beside_their_rim) {
  play_pads(Stroke::along_a_rim);
}
TEST(FreshPads, are_open_at_both_ends_of_a_cut_from_rim_to_rim) {
  play_pads(Stroke::from_rim_to_rim);
}

}  // namespace
}  // namespace sectio::test
