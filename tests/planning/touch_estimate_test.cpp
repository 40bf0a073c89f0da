// The planner's expected errors of organs and turned boxes that a ball presses, or that lie on a floor, against
// measured ones: each in the model that is taken for it, against a fine lattice. The error is that of the force, or of
// how far the top sinks.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/planning/body_shape.h"
#include "sim_server/prepare/choose_model.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/planning/planned_bodies.h"
#include "tests/support/calibration.h"

namespace sectio::test {
namespace {

struct Pressed {
  std::string name;
  TriangleSoup mesh;
  Vec3 turned_deg;
  Box fixed;
  double young_pa, poisson, ball_m, depth_m, error_budget;
  double factor = 2;  // demanded; more where it is a known failure
};

const Pressed kPressed[] = {
    {"organ", ellipsoid(3, Vec3(0.04, 0.03, 0.02)), Vec3::Zero(), below(-0.008), 6000, 0.45, 0.008, 0.003, 0.2},
    {"flat_organ", ellipsoid(3, Vec3(0.05, 0.04, 0.015)), Vec3(10, 0, 0), below(-0.005), 4000, 0.45, 0.01, 0.002, 0.3},
    {"bent_organ", bent(Vec3(0.05, 0.025, 0.02), 0.4), Vec3(0, 0, 30), below(0), 10000, 0.4, 0.006, 0.002, 0.2},
    {"egg", ellipsoid(3, Vec3(0.025, 0.025, 0.035)), Vec3(0, 30, 0), below(-0.012), 15000, 0.45, 0.012, 0.004, 0.15},
    {"turned_block", block(Vec3(0.05, 0.045, 0.03)), Vec3(0, 0, 25), below(-0.01), 8000, 0.45, 0.008, 0.002, 0.2},
    {"tilted_plate", block(Vec3(0.07, 0.06, 0.02)), Vec3(8, 5, 20), below(-0.005), 5000, 0.4, 0.01, 0.003, 0.25, 4},
};

// Height of the surface's highest point above a place.
double top_above_m(const BodySpec& body, const Vec3& place_world_m) {
  double top_m = -kFar;
  for (const auto& t : body.mesh.triangles) {
    const auto corner = [&](int i) { return body.pose.to_world(body.mesh.vertices_body_m[t[i]]); };
    const Vec3 a = corner(0), n = (corner(1) - a).cross(corner(2) - a);
    if (n.z() <= 0) continue;
    const Vec3 p(place_world_m.x(), place_world_m.y(), a.z() - n.head<2>().dot((place_world_m - a).head<2>()) / n.z());
    const auto beside = [&](int i) { return (corner((i + 1) % 3) - corner(i)).cross(p - corner(i)).dot(n) < 0; };
    if (!beside(0) && !beside(1) && !beside(2)) top_m = std::max(top_m, p.z());
  }
  return top_m;
}

Scene scene_of(const Pressed& p, const Vec3& beside_m) {
  Scene scene = planned_scene(p.name, p.mesh, p.turned_deg, p.young_pa, p.poisson, 60, p.error_budget, 0.9);
  scene.gravity_m_per_s2 = Vec3::Zero();
  BodySpec& body = scene.bodies[0];
  body.material.friction = 0;
  body.material.foundation_radius_m = std::sqrt(p.ball_m * p.depth_m);
  body.fixed = p.fixed;
  const double top_m = top_above_m(body, beside_m);
  ToolSpec probe;
  probe.name = probe.kind = "probe";
  probe.geometry = instrument_of("probe").geometry;
  probe.geometry.sphere_radius_m = p.ball_m;
  const auto at = [&](double above_m) {
    return Pose{beside_m + Vec3(0, 0, top_m + p.ball_m + above_m), Eigen::Quaterniond::Identity()};
  };
  probe.trace = {{0, at(0.001), 0}, {0.4, at(-p.depth_m), 0}, {2, at(-p.depth_m), 0}};
  scene.tools.push_back(probe);
  return scene;
}

// At the end, when nothing moves any more.
double force_n(const Scene& scene) {
  Simulation simulation(prepared(scene));
  const std::uint64_t steps = steps_of(scene, 0);
  double sum_n = 0;
  int counted = 0;
  for (std::uint64_t k = 1; k <= steps; ++k) {
    StepInput input;
    input.samples = samples_of_traces(scene, k);
    const StepOutput& out = simulation.step(input);
    if (10 * k <= 9 * steps) continue;
    sum_n += out.contacts.at(0).force_world_n.z();
    ++counted;
  }
  return sum_n / counted;
}

class EstimateOfTouch : public testing::TestWithParam<Pressed> {};
INSTANTIATE_TEST_SUITE_P(Of, EstimateOfTouch, testing::ValuesIn(kPressed), [](const auto& c) { return c.param.name; });
void PrintTo(const Pressed& p, std::ostream* out) {
  *out << p.name;
}

void hold(const std::string& name, const BodySpec& body, double actual, double factor) {
  const double expected = *body.plan.error_estimate;
  std::printf("%-22s %-20s tetrahedra %6.0f cell %.3g mm: expected %.4f, is %.4f, ratio %.2f\n", name.c_str(),
              body.model.c_str(), body.volume.tetrahedra, 1e3 * body.volume.cell_m, expected, actual,
              expected / actual);
  EXPECT_LT(expected, factor * actual);
  EXPECT_GT(expected, actual / factor);
}

Scene fine(Scene scene, double cells_across, double tetrahedra) {
  BodySpec& body = scene.bodies[0];
  body.model = "neo_hookean_lattice";
  body.volume.cell_m = planning::shape_of(body.mesh).thickness_m / cells_across;
  body.volume.tetrahedra = tetrahedra;
  return scene;
}

// The root mean square of two places, as a ball lands between the vertices by chance.
TEST_P(EstimateOfTouch, is_within_a_factor_of_two) {
  const Pressed& p = GetParam();
  const PlannedScene planned = plan_scene(scene_of(p, Vec3::Zero()), standard_engines(), calibration());
  double sum = 0;
  const std::array<Vec3, 2> places_m{Vec3::Zero(), Vec3(-0.0021, 0.0016, 0)};
  for (const Vec3& place_m : places_m) {
    Scene there = planned.scene;
    const Scene asked = scene_of(p, place_m);
    there.tools = asked.tools;
    const double truth_n = force_n(fine(asked, 14, 60000)), n = force_n(there);
    sum += std::pow(n / truth_n - 1, 2) / static_cast<double>(places_m.size());
  }
  hold("pressed_" + p.name, planned.scene.bodies[0], std::sqrt(sum), p.factor);
}

struct Lying {
  std::string name;
  TriangleSoup mesh;
  Vec3 turned_deg;
  double young_pa, poisson, error_budget;
  double factor = 2;
};
const Lying kLying[] = {
    {"flat_organ", ellipsoid(3, Vec3(0.05, 0.04, 0.015)), Vec3(0, 0, 20), 1500, 0.45, 0.15, 2.8},
    {"organ", ellipsoid(3, Vec3(0.04, 0.03, 0.02)), Vec3(0, 0, 0), 2500, 0.45, 0.1},
    {"turned_block", block(Vec3(0.05, 0.045, 0.04)), Vec3(0, 0, 30), 1500, 0.4, 0.1},
    {"turned_plate", block(Vec3(0.06, 0.05, 0.02)), Vec3(0, 0, 50), 800, 0.45, 0.1, 2.4},
};
class EstimateOfFloor : public testing::TestWithParam<Lying> {};
INSTANTIATE_TEST_SUITE_P(Of, EstimateOfFloor, testing::ValuesIn(kLying), [](const auto& c) { return c.param.name; });
void PrintTo(const Lying& l, std::ostream* out) {
  *out << l.name;
}

// How far each of the upper two thirds has sunk at the end, and how far it has gone apart.
std::array<double, 4> spread_m(const Scene& scene) {
  Simulation simulation(prepared(scene));
  for (std::uint64_t k = steps_of(scene, 0); k > 0; --k) simulation.step({});
  const TriangleMesh& mesh = simulation.mesh(0);
  double top_m = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    top_m = std::max(top_m, scene.bodies[0].pose.to_world(mesh.rest_body_m(v)).z());
  std::array<double, 4> moved_m{};
  for (int third = 0; third < 2; ++third) {
    Vec3 middle = Vec3::Zero(), now = Vec3::Zero();
    std::vector<std::pair<Vec3, Vec3>> moves;
    for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
      const Vec3 rest = scene.bodies[0].pose.to_world(mesh.rest_body_m(v));
      if (rest.z() < (third + 1) * top_m / 3 || rest.z() > (third + 2) * top_m / 3) continue;
      moves.emplace_back(rest, simulation.positions_world_m(0)[v].cast<double>());
      middle += moves.back().first;
      now += moves.back().second;
    }
    const auto n = static_cast<double>(moves.size());
    middle /= n, now /= n;
    moved_m[2 * third] = middle.z() - now.z();
    for (const auto& [from, to] : moves)
      moved_m[2 * third + 1] += ((to - now).head<2>().norm() - (from - middle).head<2>().norm()) / n;
  }
  return moved_m;
}

TEST_P(EstimateOfFloor, is_within_a_factor_of_two) {
  const Lying& l = GetParam();
  Scene scene = planned_scene(l.name, l.mesh, l.turned_deg, l.young_pa, l.poisson, 60, l.error_budget, 1.2);
  scene.floor_z_m = 0;
  BodySpec& body = scene.bodies[0];
  double lowest_m = kFar;
  for (const Vec3& x : l.mesh.vertices_body_m) lowest_m = std::min(lowest_m, (body.pose.orientation * x).z());
  body.pose.position_m.z() = -lowest_m;
  const PlannedScene planned = plan_scene(scene, standard_engines(), calibration());
  const auto truth_m = spread_m(fine(scene, 9, 30000)), is_m = spread_m(planned.scene);
  double wrong = 0, all = 0;
  for (std::size_t i = 0; i < truth_m.size(); ++i) {
    wrong += std::pow(is_m[i] - truth_m[i], 2);
    all += std::pow(truth_m[i], 2);
  }
  hold("lies_" + l.name, planned.scene.bodies[0], std::sqrt(wrong / all), l.factor);
}

}  // namespace
}  // namespace sectio::test
