// The score of an exercise against volumes that are known.
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/exercise_score.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace sectio::session_test {
namespace {

constexpr double kBall_m = 0.01;
constexpr double kGrid = 0.015;  // volumes are measured along lines: a border on one of them is a line off
constexpr double kHalfBall_m3 = 2.0 / 3 * M_PI * kBall_m * kBall_m * kBall_m;

// Two blocks of 30 x 40 x 40 mm side by side, of which the left one is held; a marked ball around where they meet.
Scene two_halves() {
  Scene scene;
  scene.gravity_m_per_s2.setZero();
  BodySpec& organ = scene.bodies.emplace_back();
  organ.name = "organ";
  for (const double x_m : {-0.03, 0.0}) {
    TriangleSoup half = test::box(6, 8, 8, Vec3(0.03, 0.04, 0.04));
    const auto first = static_cast<VertexId>(organ.mesh.vertices_body_m.size());
    for (const Vec3& v : half.vertices_body_m) organ.mesh.vertices_body_m.push_back(v + Vec3(x_m, -0.02, -0.02));
    for (const auto& t : half.triangles) organ.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  organ.fixed = Box{Vec3(-0.031, -1, -1), Vec3(-0.02, 1, 1)};
  Region ball;
  ball.name = "tumour";
  ball.marked = true;
  ball.parts = {{RegionForm::ellipsoid, Vec3::Zero(), Vec3::Constant(kBall_m), 0, 0, Eigen::Quaterniond::Identity()}};
  organ.regions = {ball};
  scene.exercise = ExerciseSpec{"organ", Box{Vec3(-0.001, -1, -1), Vec3(1, 1, 1)}, {}};
  scene.tools.resize(2);
  scene.tools[0].name = "moves";
  scene.tools[1].name = "waits";
  return scene;
}

TEST(C_EXP, C_EXP_1_half_of_a_marked_ball_is_removed_with_the_healthy_tissue_around_it) {
  const Scene scene = two_halves();
  const Simulation simulation(prepared(scene));
  const Score score = ExerciseScore(scene, simulation).finish();
  EXPECT_NEAR(score.marked_m3, 2 * kHalfBall_m3, kGrid * kHalfBall_m3);
  EXPECT_NEAR(score.marked_removed_m3, kHalfBall_m3, kGrid * kHalfBall_m3);
  EXPECT_NEAR(score.healthy_lost_m3, 0.03 * 0.04 * 0.04 - kHalfBall_m3, kGrid * kHalfBall_m3);
  EXPECT_TRUE(score.in_bin);
  EXPECT_NEAR(score.marked_in_bin_m3, score.marked_removed_m3, 1e-12);
  ASSERT_EQ(score.removed.size(), 1u);
  EXPECT_EQ(score.removed[0].body, "organ");
}

TEST(C_EXP, C_EXP_1_what_is_not_in_the_bin_as_a_whole_is_not_in_the_bin) {
  Scene scene = two_halves();
  const Simulation simulation(prepared(scene));
  scene.exercise->bin->max_world_m.x() = 0.029;
  const Score score = ExerciseScore(scene, simulation).finish();
  EXPECT_FALSE(score.in_bin);
  EXPECT_EQ(score.marked_in_bin_m3, 0);
  EXPECT_NEAR(score.marked_removed_m3, kHalfBall_m3, kGrid * kHalfBall_m3) << "removed all the same";
}

TEST(C_EXP, C_EXP_1_an_organ_that_nothing_holds_is_its_largest_piece) {
  Scene scene = two_halves();
  scene.bodies[0].fixed.reset();
  for (std::size_t v = 0; v < scene.bodies[0].mesh.vertices_body_m.size() / 2; ++v)
    scene.bodies[0].mesh.vertices_body_m[v].x() *= 1.2;
  const Simulation simulation(prepared(scene));
  const Score score = ExerciseScore(scene, simulation).finish();
  ASSERT_EQ(score.removed.size(), 1u);
  EXPECT_NEAR(score.removed[0].marked_m3 + score.removed[0].healthy_m3, 0.03 * 0.04 * 0.04, 1e-7);
}

TEST(C_EXP, C_EXP_1_instruments_have_paths_forces_and_times) {
  Scene scene = two_halves();
  for (ToolSpec& tool : scene.tools) tool.kind = "probe", tool.geometry = instrument_of("probe").geometry;
  Simulation simulation(prepared(scene));
  ExerciseScore score(scene, simulation);
  StepInput input;
  // 40 mm down, 2 mm and the ball's 1.5 mm of them into the left block, and up again.
  for (std::uint64_t k = 0; k <= 800; ++k) {
    const double down = k < 400 ? 1e-4 * static_cast<double>(k) : 1e-4 * static_cast<double>(800 - k);
    input.samples = {{0, k + 1, 1e-3 * static_cast<double>(k), Pose{Vec3(-0.01, 0.001, 0.058 - down)}, 0}};
    score.add(simulation.step(input));
  }
  const Score result = score.finish();
  EXPECT_NEAR(result.instruments[0].path_m, 0.007, 0.002) << "from the first touch to the last";
  EXPECT_GT(result.instruments[0].largest_force_n, 0.01);
  EXPECT_EQ(result.largest_force_n, result.instruments[0].largest_force_n);
  EXPECT_NEAR(result.instruments[0].contact_time_s, 0.07, 0.02);
  EXPECT_NEAR(result.time_s, 0.07, 0.02);
  EXPECT_EQ(result.instruments[1].path_m, 0);
  const std::vector<std::string> lines = to_lines(result);
  EXPECT_EQ(lines[0], "marked tissue removed      2.118 ml  (50.5 %)");
  EXPECT_EQ(lines.size(), 6u);
}

// The probe comes down twice on the body that it should spare, and once on the organ.
TEST(C_EXP, C_EXP_1_a_touch_of_what_is_to_be_spared_is_counted) {
  Scene scene = two_halves();
  BodySpec nerve;
  nerve.name = "nerve";
  nerve.mesh = test::box(6, 8, 8, Vec3(0.03, 0.04, 0.04));
  nerve.pose.position_m = Vec3(0.1, -0.02, -0.02);
  nerve.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -0.01)};
  scene.bodies.push_back(nerve);
  for (ToolSpec& tool : scene.tools) tool.kind = "probe", tool.geometry = instrument_of("probe").geometry;
  for (const bool spared : {true, false}) {
    if (spared) scene.exercise->spare = {"nerve"};
    if (!spared) scene.exercise->spare.clear();
    Simulation simulation(prepared(scene));
    ExerciseScore score(scene, simulation);
    StepInput input;
    std::uint64_t k = 0;
    for (const double x_m : {0.115, 0.115, -0.01})
      for (int i = 0; i <= 800; ++i, ++k) {
        const double down = 1e-4 * (i < 400 ? i : 800 - i);
        input.samples = {{0, k + 1, 1e-3 * static_cast<double>(k), Pose{Vec3(x_m, 0.001, 0.058 - down)}, 0}};
        score.add(simulation.step(input));
      }
    const Score result = score.finish();
    EXPECT_EQ(result.spared_touches, spared ? std::optional<std::size_t>(2) : std::nullopt);
    EXPECT_EQ(to_lines(result)[3].find("touched beside                 2 times") == 0, spared);
  }
}

// A line of 100 mm along x, and a blade whose shaft is upright.
struct AlongALine : testing::Test {
  LineSpec line{{Vec3(0, 0, 0), Vec3(0.1, 0, 0)}, 0.005, 0.002};
  LineWatch watch{line, Pose{Vec3(0, 0, 0.02)}};

  // From x = 0 on at 50 mm/s.
  LineScore draw(double to_m, double beside_m, double depth_m) {
    constexpr double kWay_m = 5e-5;
    for (int i = 0; i * kWay_m < to_m; ++i)
      watch.add(Vec3(i * kWay_m, beside_m, 0.02 - depth_m), Vec3::UnitZ(), kWay_m);
    return watch.finish();
  }
};

TEST_F(AlongALine, half_of_it_that_is_cut_beside_and_too_shallow_is_scored_so) {
  const LineScore score = draw(0.05, 0.001, 0.004);
  EXPECT_NEAR(score.length_m, 0.1, 1e-9);
  EXPECT_NEAR(score.cut_fraction, 0.51, 0.02);
  EXPECT_NEAR(score.deviation_m, 0.001, 1e-9);
  EXPECT_NEAR(score.most_deviation_m, 0.001, 1e-9);
  EXPECT_NEAR(score.depth_m, 0.004, 1e-9);
  EXPECT_EQ(score.astray_m, 0);
  ASSERT_EQ(score.beside_m.size(), kLineParts);
  EXPECT_NEAR(score.beside_m[10].value_or(0), 0.001, 1e-9);
  EXPECT_FALSE(score.beside_m[30]) << "no blade was there";
}

TEST_F(AlongALine, a_scratch_or_a_cut_elsewhere_is_none_of_it) {
  EXPECT_EQ(draw(0.1, 0, 0.001).cut_fraction, 0) << "less than half as deep as it should be";
  const LineScore score = draw(0.1, 0.004, 0.005);
  EXPECT_EQ(score.cut_fraction, 0);
  EXPECT_NEAR(score.astray_m, 0.1, 1e-3);
}

TEST_F(AlongALine, a_perfect_hand_is_nowhere_beside_it_however_fine_the_tolerance) {
  line.within_m = 1e-5;
  watch = LineWatch{line, Pose{Vec3(0, 0, 0.02)}};
  const LineScore score = draw(0.1, 0, 0.005);
  EXPECT_EQ(score.cut_fraction, 1);
  EXPECT_NEAR(score.most_deviation_m, 0, 1e-9);
  EXPECT_EQ(score.astray_m, 0);
}

TEST_F(AlongALine, the_deepest_of_several_passages_counts) {
  for (const double depth_m : {0.001, 0.002, 0.003, 0.005, 0.004}) draw(0.1, 0, depth_m);
  EXPECT_NEAR(watch.finish().depth_m, 0.005, 1e-9);
  EXPECT_EQ(watch.finish().cut_fraction, 1);
}

TEST_F(AlongALine, a_blade_that_has_never_cut_has_reached_nothing) {
  const LineScore score = watch.finish();
  EXPECT_EQ(score.cut_fraction, 0);
  EXPECT_NEAR(score.deviation_m, 0.1, 1e-9) << "the line's length";
}

// Trembling by so much at 10 Hz on a way of `way_m` in a second, which begins and ends slowly.
double tremor_told_m(double way_m, double tremor_m, double step_s = 1e-3) {
  TremorGauge gauge(step_s);
  for (double t_s = 0; t_s < 1; t_s += step_s) {
    const double x_m = way_m * (10 * std::pow(t_s, 3) - 15 * std::pow(t_s, 4) + 6 * std::pow(t_s, 5));
    gauge.add(Vec3(x_m, tremor_m * std::sqrt(2) * std::sin(2 * M_PI * 10 * t_s), 0), t_s > 0.2);
  }
  return gauge.rms_m();
}

TEST(Tremor, of_a_hand_is_told_whatever_its_speed) {
  for (const double way_m : {0.0, 0.02, 0.2})
    for (const double step_s : {1e-3, 1.0 / 60}) EXPECT_NEAR(tremor_told_m(way_m, 3e-4, step_s), 3e-4, 8e-5) << way_m;
  EXPECT_LT(tremor_told_m(0.2, 0), 3e-5) << "a fast hand that doesn't tremble";
}

TEST(Tremor, is_none_of_a_corner_nor_of_moves_in_the_air_nor_of_a_rest) {
  TremorGauge gauge(1e-3);
  for (int i = 0; i < 2000; ++i)
    gauge.add(i < 1000 ? Vec3(0, 0, -2e-5 * i) : Vec3(5e-5 * (i - 1000), 0, -0.02), i > 700);
  EXPECT_LT(gauge.rms_m(), 1e-5);
  gauge = TremorGauge(1e-3);
  for (int i = 0; i < 9000; ++i) {
    const double x_m = i < 2000 ? 1e-5 * i + 3e-4 * std::sqrt(2) * std::sin(2 * M_PI * 0.01 * i) : 0.02;
    gauge.add(Vec3(x_m, 0, 0), true);
  }
  EXPECT_NEAR(gauge.rms_m(), 3e-4, 8e-5) << "it has stood still for long since";
  gauge = TremorGauge(1e-3);
  for (int i = 0; i < 2000; ++i) gauge.add(Vec3(0.01 * std::sin(0.1 * i), 0, 0), false);
  EXPECT_EQ(gauge.rms_m(), 0);
}

}  // namespace
}  // namespace sectio::session_test
