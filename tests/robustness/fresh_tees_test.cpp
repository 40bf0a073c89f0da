// Slabs of a volume with a slit, to which a second cut comes from a rim, and goes a little further.
#include <sstream>

#include "tests/robustness/fresh_scenes.h"

namespace sectio::test {
namespace {

const Vec3 kHalfSlab_m(0.022, 0.016, 0.006);
constexpr double kOverSlab_m = 0.012, kToSlab_s = 0.4;

std::string make_tee(std::uint64_t seed, const std::string& directory) {
  Numbers numbers(seed);
  const double deep_m = numbers.between(0.0053, 0.0062), past_m = numbers.between(0.0005, 0.0025),
               angle_rad = numbers.between(1.05, 2.1), speed_m_per_s = numbers.between(0.015, 0.04),
               at_x_m = numbers.between(-0.006, 0.006), slit_y_m = numbers.between(0, 0.004);
  VolumeKeys volume{numbers.one_of(std::array<const char*, 3>{"neo_hookean", "tetra_springs", "neo_hookean_lattice"}),
                    "deformable", 1500, numbers.between(12e3, 30e3)};
  std::vector<TracePoint> trace;
  const auto go = [&](const Vec3& tip_m, const Vec3& ahead, double takes_s) {
    const double time_s = trace.empty() ? 0.1 : trace.back().time_s + takes_s;
    trace.push_back({time_s, held(tip_m, Vec3::UnitZ(), ahead), 0});
  };
  const auto stroke = [&](const Vec3& from_m, const Vec3& to_m) {
    const Vec3 ahead = (to_m - from_m).normalized(), up_m(0, 0, kOverSlab_m + deep_m);
    go(from_m + up_m, ahead, kToSlab_s);
    go(from_m, ahead, kToSlab_s);
    go(to_m, ahead, (to_m - from_m).norm() / speed_m_per_s);
    go(to_m + up_m, ahead, kToSlab_s);
  };
  const double z_m = kHalfSlab_m.z() - deep_m;
  const Vec3 meets_m(at_x_m, slit_y_m, z_m), way(std::cos(angle_rad), std::sin(angle_rad), 0);
  stroke(Vec3(-0.013, slit_y_m, z_m), Vec3(0.013, slit_y_m, z_m));
  stroke(meets_m - (kHalfSlab_m.y() + slit_y_m + 0.006) / way.y() * way, meets_m + past_m / way.y() * way);

  leave_files(directory, box(18, 13, 5, 2 * kHalfSlab_m), trace);
  std::ofstream(directory + "/scene.yaml")
      << "session: tee_" << seed << "\nstep_s: 0.001\nduration_s: " << trace.back().time_s + 0.3 << R"(
expect: {incisions: 1, pieces_freed: 0}
camera: {eye_world_m: [0.03, -0.05, 0.07], target_world_m: [0, 0, 0], field_of_view_deg: 32}
bodies:
  - name: pad
    mesh: {file: body.obj, unit: m}
    pose: {position_world_m: [)"
      << -kHalfSlab_m.x() << ", " << -kHalfSlab_m.y() << ", " << -kHalfSlab_m.z() << "]}\n"
      << volume.text() << "    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, " << -0.7 * kHalfSlab_m.z()
      << R"(]}
tools:
  - {name: knife, kind: knife, trace: hand.csv, geometry: {a_tool_m: [0, 0, 0], b_tool_m: [0, 0, 0.09],
     c_tool_m: [0.002, 0, 0.07], d_tool_m: [0.002, 0, 0.09], sharp_length_m: 0.06}}
)";
  std::ostringstream words;
  words << "ends " << 1e3 * past_m << " mm past the slit at " << angle_rad * 180 / M_PI << " degrees, " << 1e3 * deep_m
        << " mm deep, " << 1e3 * speed_m_per_s << " mm/s\n"
        << volume.text();
  return words.str();
}

TEST(FreshTees, open_into_the_slit_that_they_come_to) {
  play(make_tee, 10);
}

}  // namespace
}  // namespace sectio::test
