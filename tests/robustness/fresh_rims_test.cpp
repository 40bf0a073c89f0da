// Pads of skin that are cut beside a rim.
#include <sstream>

#include "tests/robustness/fresh_scenes.h"

namespace sectio::test {
namespace {

constexpr double kHalfLength_m = 0.04, kHalfWidth_m = 0.03, kHalfHeight_m = 0.006;
constexpr double kOverPad_m = 0.012, kToPad_s = 0.3;

// The blade goes along the rim, nearer to it than deep.
std::string make_pad(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double beside_m = numbers.between(0.0006, 0.002), depth_m = numbers.between(0.0045, 0.006),
               length_m = numbers.between(0.02, 0.045), speed_m_per_s = numbers.between(0.01, 0.06),
               young_pa = numbers.between(12e3, 25e3), aside = numbers.between(-0.08, 0.08);
  const double turn_rad = numbers.one_of(std::array{0.0, M_PI});
  const Mat3 turned = Eigen::AngleAxisd(turn_rad, Vec3::UnitZ()).toRotationMatrix();
  std::vector<TracePoint> trace;
  const auto go = [&](double x_m, double above_m, double takes_s) {
    const Vec3 tip_m(x_m, beside_m - kHalfWidth_m, kHalfHeight_m + above_m);
    const double time_s = trace.empty() ? 0.1 : trace.back().time_s + takes_s;
    const Vec3 shaft = Vec3(0, aside, 1).normalized();
    trace.push_back({time_s, held(turned * tip_m, turned * shaft, turned * Vec3::UnitX()), 0});
  };
  go(-0.5 * length_m, kOverPad_m, 0);
  go(-0.5 * length_m, -depth_m, kToPad_s);
  go(0.5 * length_m, -depth_m, length_m / speed_m_per_s);
  go(0.5 * length_m, kOverPad_m, kToPad_s);

  leave_files(directory, box(32, 24, 5, Vec3(2 * kHalfLength_m, 2 * kHalfWidth_m, 2 * kHalfHeight_m)), trace);
  std::ostringstream body;
  body << "    material: {young_pa: " << young_pa
       << ", poisson: 0.45, density_kg_per_m3: 1050, foundation_radius_m: 0.03, pretension: 0.1, damping_per_s: 30}\n"
       << "    cutting: {threshold_force_n: 0.06}\n";
  std::ofstream(directory + "/scene.yaml")
      << "session: rim_" << seed << "\nstep_s: auto\nduration_s: " << trace.back().time_s + 0.3
      << "\nexpect: {incisions: 1, pieces_freed: 0, cut_m: " << 0.85 * length_m - 0.002 << " to "
      << 1.6 * length_m + 0.005 << R"(}
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
  words << 1e3 * beside_m << " mm beside the rim, " << 1e3 * depth_m << " mm deep, " << 1e3 * length_m << " mm long, "
        << 1e3 * speed_m_per_s << " mm/s\n"
        << body.str();
  return words.str();
}

TEST(FreshPads, are_cut_beside_their_rim) {
  play(make_pad, 8);
}

}  // namespace
}  // namespace sectio::test
