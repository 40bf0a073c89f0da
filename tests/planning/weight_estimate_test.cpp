// The planner's expected errors of bodies under their own weight against measured ones: organs and turned boxes that
// hang, stand, or are held at a side, each in the model that is taken for it, against a lattice of nine cells across,
// which ends finely where the body is held.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/planning/body_loads.h"
#include "sim_server/prepare/choose_model.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/planning/planned_bodies.h"
#include "tests/support/calibration.h"
#include "tests/support/environment.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

struct Weighed {
  std::string name;
  TriangleSoup mesh;
  Vec3 turned_deg;
  Box fixed;  // in the world; empty: it lies on a floor at its lowest point
  double young_pa = 5000, error_budget = 0.1;
  double factor = 2;  // demanded; more where it is a known failure
  double poisson = 0.45;
};

const Weighed kBodies[] = {
    {"organ_hangs", ellipsoid(3, Vec3(0.03, 0.025, 0.045)), Vec3::Zero(), above(0.03)},
    {"organ_stands", ellipsoid(3, Vec3(0.03, 0.025, 0.045)), Vec3::Zero(), below(-0.03), 8000},
    {"bent_organ_hangs", bent(Vec3(0.05, 0.025, 0.02), 0.4), Vec3(0, 90, 0), above(0.025), 4000, 0.08},
    {"bent_organ_at_side", bent(Vec3(0.05, 0.025, 0.016), 0.4), Vec3::Zero(), beyond(-0.01), 15000, 0.1},
    {"flat_organ_stands", ellipsoid(3, Vec3(0.05, 0.04, 0.015)), Vec3::Zero(), below(-0.008), 2000, 0.15},
    {"turned_bar_hangs", block(Vec3(0.08, 0.025, 0.02)), Vec3(20, 70, 0), above(0.025)},
    {"turned_bar_at_side", block(Vec3(0.09, 0.022, 0.02)), Vec3(30, 10, 15), beyond(-0.02), 25000, 0.1},
    {"turned_block_hangs", block(Vec3(0.04, 0.035, 0.05)), Vec3(25, 15, 0), above(0.018), 3000, 0.1},
    {"turned_block_stands", block(Vec3(0.04, 0.035, 0.05)), Vec3(25, 15, 0), below(-0.018), 4000, 0.05},
    {"turned_plate_stands", block(Vec3(0.06, 0.05, 0.02)), Vec3(10, 20, 30), below(-0.012), 15000, 0.1},
    {"liver_at_side", bent(Vec3(0.06, 0.035, 0.02), 0.25), Vec3(15, 0, 20), beyond(-0.02), 12000, 0.08, 2.2},
    {"thin_organ_at_side", ellipsoid(3, Vec3(0.05, 0.03, 0.011)), Vec3(0, 20, 0), beyond(-0.015), 30000, 0.08},
    {"egg_stands", ellipsoid(3, Vec3(0.025, 0.025, 0.04)), Vec3(0, 40, 0), below(-0.016), 6000, 0.1},
    {"kidney_hangs", bent(Vec3(0.05, 0.022, 0.022), 0.3), Vec3(0, 70, 0), above(0.02), 4000, 0.05},
    {"turned_cube_stands", block(Vec3(0.04, 0.04, 0.04)), Vec3(30, 30, 0), below(-0.01), 5000, 0.1},
    {"turned_plate_at_side", block(Vec3(0.07, 0.05, 0.014)), Vec3(0, 15, 20), beyond(-0.015), 40000, 0.06},
};

Scene scene_of(const Weighed& w) {
  Scene scene = planned_scene(w.name, w.mesh, w.turned_deg, w.young_pa, w.poisson, 25, w.error_budget, 0.8);
  scene.bodies[0].fixed = w.fixed;
  return scene;
}

// The displacement by the weight: of the two parts of the body that are further from what is held, each as an affine
// field of its vertices, at its middle.
std::vector<Vec3> moved_m(const Scene& scene) {
  Simulation simulation(prepared(scene));
  const int steps = static_cast<int>(std::lround(scene.duration_s / scene.step_s));
  for (int i = 0; i < steps; ++i) simulation.step({});
  const TriangleMesh& mesh = simulation.mesh(0);
  const BodySpec& body = scene.bodies[0];
  Vec3 held = Vec3::Zero();
  int count = 0;
  for (const Vec3& p : body.mesh.vertices_body_m)
    if (body.fixed->contains(body.pose.to_world(p))) held += body.pose.to_world(p), ++count;
  held /= count;
  double furthest = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    furthest = std::max(furthest, (body.pose.to_world(mesh.rest_body_m(v)) - held).norm());
  std::vector<Vec3> moved;
  for (const double from : {0.4, 0.7}) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : body.mesh.vertices_body_m) middle += p / static_cast<double>(body.mesh.vertices_body_m.size());
    for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
      const Vec3 rest = body.pose.to_world(mesh.rest_body_m(v));
      const double share = (rest - held).norm() / furthest;
      if (share < from || share > from + 0.3) continue;
      const Eigen::Vector4d row = (Eigen::Vector4d() << 1, rest - middle).finished();
      const Vec3 u = simulation.positions_world_m(0)[v].cast<double>() - rest;
      normal += row * row.transpose();
      right += row * u.transpose();
    }
    const Eigen::Matrix<double, 4, 3> field = normal.ldlt().solve(right);
    const Vec3 at = (held + (from + 0.15) * furthest * (middle - held).normalized()) - middle;
    moved.push_back(field.transpose() * (Eigen::Vector4d() << 1, at).finished());
  }
  return moved;
}

class EstimateOfWeight : public testing::TestWithParam<Weighed> {};
INSTANTIATE_TEST_SUITE_P(Of, EstimateOfWeight, testing::ValuesIn(kBodies), [](const auto& c) { return c.param.name; });
void PrintTo(const Weighed& w, std::ostream* out) {
  *out << w.name;
}

// Expected over actual error.
double ratio_of(const Weighed& w) {
  const PlannedScene planned = plan_scene(scene_of(w), standard_engines(), calibration());
  const BodySpec& body = planned.scene.bodies[0];
  Scene fine = scene_of(w);
  fine.bodies[0].model = "neo_hookean_lattice";
  const double thickness_m = planning::shape_of(w.mesh).thickness_m;
  fine.bodies[0].volume.cell_m = thickness_m / 9;
  fine.bodies[0].volume.tetrahedra = 40000;
  const auto truth = moved_m(fine), now = moved_m(planned.scene);
  double wrong = 0, all = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    wrong += (now[i] - truth[i]).squaredNorm();
    all += truth[i].squaredNorm();
  }
  const double actual = std::sqrt(wrong) / std::max(std::sqrt(all), planning::kSagThatMatters * thickness_m);
  const double expected = *body.plan.error_estimate;
  std::printf("%-20s %-20s tetrahedra %6.0f cell %.3g mm: moved %.3g mm, expected %.4f, is %.4f, ratio %.2f\n",
              w.name.c_str(), body.model.c_str(), body.volume.tetrahedra, 1e3 * body.volume.cell_m,
              1e3 * truth.back().norm(), expected, actual, expected / actual);
  return expected / actual;
}

TEST_P(EstimateOfWeight, is_within_a_factor_of_two) {
  const Weighed& w = GetParam();
  const double ratio = ratio_of(w);
  EXPECT_LT(ratio, w.factor);
  EXPECT_GT(ratio, 1 / w.factor);
}

// An ellipsoid, a bent one or a box, turned and held above, below or beside, which moves by a few to a few tens of
// percent of what is free.
Weighed random_body(test::Random& random, int number) {
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  const int form = number % 3, hold = number / 3 % 3;
  constexpr const char* kForms[] = {"ellipsoid", "bent", "block"};
  constexpr const char* kHolds[] = {"hangs", "stands", "at_side"};
  Weighed w;
  w.name = std::string("random_") + kForms[form] + "_" + kHolds[hold];
  const double a = between(0.03, 0.06), b = a * between(0.4, 0.9), c = b * between(0.4, 1.0), by = between(0.15, 0.5);
  w.mesh = form == 0 ? ellipsoid(3, Vec3(a, b, c)) : form == 1 ? bent(Vec3(a, b, c), by) : block(1.5 * Vec3(a, b, c));
  for (double& angle_deg : w.turned_deg) angle_deg = hold == 2 ? between(-25, 25) : between(-30, 90);
  w.poisson = between(0.3, 0.48);
  w.error_budget = between(0.03, 0.15);
  Eigen::AlignedBox3d world;
  for (const Vec3& p : w.mesh.vertices_body_m) world.extend(turned(w.turned_deg) * p);
  const double share = between(0.12, 0.4), along_m = world.sizes()[hold == 2 ? 0 : 2];
  if (hold == 0) w.fixed = above(world.max().z() - share * along_m);
  if (hold == 1) w.fixed = below(world.min().z() + share * along_m);
  if (hold == 2) w.fixed = beyond(world.min().x() + share * along_m);
  const double free_m = (1 - share) * along_m, moves_m = between(0.03, 0.2) * free_m, thickness_m = 2 * c;
  const double sag_m2 = hold == 2 ? 0.9 * std::pow(free_m, 4) / (thickness_m * thickness_m) : 0.5 * free_m * free_m;
  w.young_pa = (hold == 1 ? 10 : 1) * 1050 * 9.81 * sag_m2 / moves_m;  // it must not bend aside
  return w;
}

// SECTIO_SEED and SECTIO_BODIES: others, and more.
TEST(EstimateOfWeight, of_nine_random_bodies_at_least_seven_are_within_a_factor_of_two) {
  test::Random random(test::number_from("SECTIO_SEED", 20261125));
  const int bodies = static_cast<int>(test::number_from("SECTIO_BODIES", 9));
  int within = 0;
  for (int n = 0; n < bodies; ++n) {
    const double ratio = ratio_of(random_body(random, n));
    within += ratio < 2 && ratio > 0.5;
  }
  std::printf("%d of %d within a factor of two\n", within, bodies);
  EXPECT_GE(within, 7 * bodies / 9);
}

}  // namespace
}  // namespace sectio::test
