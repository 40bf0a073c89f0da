// The planner's expected errors against measured ones: bodies that the chart does not have, each in the model that is
// taken for it, against triquadratic bricks (a ball: against the closed form).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/planning/planned_specimens.h"
#include "tests/support/calibration.h"

namespace sectio::test {
namespace {

using planning::Load;

class Estimate : public testing::TestWithParam<PlannedCase> {};

const PlannedCase kCases[] = {
    {"long_bar", Load::bending, {0.12, 0.02, 0.02}, {4, 1, 1}, 20000, 0.45, 0.04},
    {"stiff_bar", Load::bending, {0.09, 0.03, 0.03}, {3, 1, 1}, 60000, 0.3, 0.02},
    {"plate", Load::bending, {0.06, 0.04, 0.01}, {3, 2, 1}, 80000, 0.4, 0.04},
    {"odd_bar", Load::bending, {0.083, 0.0217, 0.0171}, {4, 1, 1}, 30000, 0.45, 0.1},
    {"odd_soft_bar", Load::bending, {0.061, 0.0237, 0.0189}, {3, 1, 1}, 8000, 0.4, 0.06},
    {"hanging_block", Load::hanging, {0.03, 0.04, 0.05}, {1, 1, 2}, 3000, 0.45, 0.1},
    {"hanging_rod", Load::hanging, {0.02, 0.02, 0.08}, {1, 1, 3}, 5000, 0.4, 0.05},
    {"twisted_bar", Load::twisting, {0.12, 0.02, 0.02}, {4, 1, 1}, 20000, 0.45, 0.3},
    {"twisted_ruler", Load::twisting, {0.09, 0.03, 0.015}, {3, 1, 1}, 40000, 0.4, 0.2},
    {"twisted_odd_bar", Load::twisting, {0.083, 0.0217, 0.0171}, {4, 1, 1}, 10000, 0.45, 0.12},
    {"block", Load::indentation, {0.06, 0.06, 0.03}, {1, 1, 1}, 6000, 0.45, 0.12, 0.012, 0.003},
    {"odd_block", Load::indentation, {0.071, 0.063, 0.0237}, {1, 1, 1}, 15000, 0.4, 0.15, 0.008, 0.002},
    {"touched_block", Load::indentation, {0.08, 0.08, 0.04}, {1, 1, 1}, 10000, 0.45, 0.45, 0.01, 0.002, 16},
    {"cut_bar", Load::opening, {0.05, 0.01, 0.024}, {4, 1, 2}, 30000, 0.45, 0.25, 0.01, 0.012},
    {"cut_odd_bar", Load::opening, {0.067, 0.013, 0.0191}, {4, 1, 2}, 15000, 0.4, 0.3, 0.01, 0.00955},
};
INSTANTIATE_TEST_SUITE_P(Of, Estimate, testing::ValuesIn(kCases), [](const auto& c) { return c.param.name; });

// A ball lands between the vertices by chance: hence the root mean square of four places.
double error_of(const PlannedCase& c, const BodySpec& body, double step_s) {
  chart::ChartScene s = chart_scene_of(c);
  const std::vector<double> truth = chart::reference_of(s, false).answer;
  std::vector<Vec3> places{Vec3::Zero()};
  if (c.load == Load::indentation)
    places = {Vec3::Zero(), Vec3(0.0013, 0.0007, 0), Vec3(-0.0021, 0.0016, 0), Vec3(0.0029, -0.0024, 0)};
  double sum = 0;
  for (const Vec3& beside : places) {
    if (s.ball) s.ball->beside_m = beside;
    const auto specimen = specimen_of(s, body, c, step_s);
    const double error = chart::relative_error(answer_at_rest(*specimen, s), truth);
    sum += error * error / static_cast<double>(places.size());
  }
  return std::sqrt(sum);
}

TEST_P(Estimate, is_within_a_factor_of_two) {
  const PlannedCase& c = GetParam();
  const PlannedScene planned = plan_scene(scene_of(c), standard_engines(), calibration());
  const BodySpec& body = planned.scene.bodies[0];
  const double actual = error_of(c, body, planned.scene.step_s);
  std::printf("%-16s %-20s tetrahedra %6.0f cell %.3g mm: expected %.4f, is %.4f, ratio %.2f\n", c.name.c_str(),
              body.model.c_str(), body.volume.tetrahedra, 1e3 * body.volume.cell_m, *body.plan.error_estimate, actual,
              *body.plan.error_estimate / actual);
  EXPECT_LT(*body.plan.error_estimate, 2 * actual) << planned.table;
  EXPECT_GT(*body.plan.error_estimate, actual / 2) << planned.table;
}

// An organ hangs over from somewhere: how far its end sinks.
double sunk_m(const Scene& scene) {
  constexpr double kEnd_m = 0.035;
  Simulation simulation(prepared(scene));
  const int steps = static_cast<int>(std::lround(scene.duration_s / scene.step_s));
  for (int i = 0; i < steps; ++i) simulation.step({});
  const TriangleMesh& mesh = simulation.mesh(0);
  double sum = 0;
  int n = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (mesh.rest_body_m(v).x() < kEnd_m) continue;
    sum += mesh.rest_body_m(v).z() - double{simulation.positions_world_m(0)[v].z()};
    ++n;
  }
  return sum / n;
}

double sunk_m(Scene scene, double tetrahedra) {
  scene.bodies[0].model = "neo_hookean";
  scene.bodies[0].volume = {};
  scene.bodies[0].volume.tetrahedra = tetrahedra;
  return sunk_m(scene);
}

// The border of the held region falls between the vertices by chance: the root mean square of four places, against
// much finer tetrahedra.
TEST(EstimateOfOrgan, is_within_a_factor_of_two) {
  Scene scene;
  scene.file = "organ";
  scene.sleep.after_s = 0;
  scene.duration_s = 0.6;
  scene.bodies.emplace_back();
  BodySpec& organ = scene.bodies[0];
  organ.name = "organ";
  organ.model = "auto";
  organ.mesh = ellipsoid(3, Vec3(0.045, 0.016, 0.014));
  organ.material.young_pa = 12000;
  organ.fixed = Box{Vec3(-1, -1, -1), Vec3(-0.005, 1, 1)};
  organ.plan.error_budget = 0.09;
  organ.plan.cpu_budget = 4;
  const PlannedScene planned = plan_scene(scene, standard_engines(), calibration());
  const BodySpec& body = planned.scene.bodies[0];
  double sum = 0;
  const std::array<double, 4> borders_m{-0.004, -0.0063, -0.0085, -0.0107};
  for (const double border_m : borders_m) {
    Scene there = planned.scene;
    there.bodies[0].fixed->max_world_m.x() = border_m;
    const double sunk = sunk_m(there), truth = sunk_m(there, 36000);
    sum += std::pow(sunk / truth - 1, 2) / static_cast<double>(borders_m.size());
  }
  const double actual = std::sqrt(sum), expected = *body.plan.error_estimate;
  std::printf("%-16s %-20s tetrahedra %6.0f cell %.3g mm: expected %.4f, is %.4f, ratio %.2f\n", "organ",
              body.model.c_str(), body.volume.tetrahedra, 1e3 * body.volume.cell_m, expected, actual,
              expected / actual);
  EXPECT_LT(expected, 2 * actual) << planned.table;
  EXPECT_GT(expected, actual / 2) << planned.table;
}

}  // namespace
}  // namespace sectio::test
