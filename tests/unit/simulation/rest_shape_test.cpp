// A body keeps the shape in which it was given until it is cut; what nothing holds falls.
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "sim_server/engine/standard_traits.h"
#include "tests/support/loop_cut.h"

namespace sectio::test {
namespace {

double volume_m3(const Operation& op) {
  std::vector<Vec3> at;
  for (const Vec3f& x : op.simulation.positions_world_m(0)) at.push_back(x.cast<double>());
  return check(op.mesh(), at).volume_m3;
}
double mean_height_m(const Operation& op) {
  double sum = 0;
  const auto at = op.simulation.positions_world_m(0);
  for (const Vec3f& x : at) sum += double{x.z()};
  return sum / static_cast<double>(at.size());
}

class Shipped : public testing::TestWithParam<const char*> {};

TEST_P(Shipped, a_body_at_rest_keeps_its_given_shape) {
  Scene scene = load_scene(std::string(SECTIO_SOURCE_DIR "/deploy/scenes/") + GetParam() + ".yaml", standard_traits());
  scene.tools.clear();
  scene.sleep.after_s = 0;
  Operation op(scene);
  const double given_m3 = volume_m3(op);
  op.rest(1500);
  EXPECT_NEAR(volume_m3(op) / given_m3, 1, 0.002);
  EXPECT_LT(op.farthest_from_rest_m(), 6e-4);
}
INSTANTIATE_TEST_SUITE_P(RestShape, Shipped,
                         testing::Values("liver_incision", "kidney_loop", "skin_cross", "bar_one_sequence"));

// The weight is carried in the gravity of the beginning: tissue follows gravity that turns, and comes back with it.
TEST(RestShape, follows_gravity_that_turns) {
  Scene scene = organ_scene();
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.gravity_turns_deg_per_s = 360;
  scene.sleep.after_s = 0;
  Operation op(scene);
  op.rest(500);
  const double upright_m = op.farthest_from_rest_m();
  StepInput tilt;
  tilt.gravity_m_per_s2 = Vec3(9.81, 0, 0);
  op.step(tilt);
  op.rest(1500);
  const MaterialSpec& m = scene.bodies[0].material;
  const double bed_pa_per_m = 2 * m.young_pa / (1 - m.poisson * m.poisson) / (M_PI * m.foundation_radius_m);
  const double sag_m = m.density_kg_per_m3 * 9.81 * m.foundation_radius_m / bed_pa_per_m;
  EXPECT_GT(op.farthest_from_rest_m(), sag_m) << "sideways, and up by the weight";
  EXPECT_LT(op.farthest_from_rest_m(), 2 * sag_m);
  tilt.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  op.step(tilt);
  op.rest(2000);
  EXPECT_NEAR(op.farthest_from_rest_m(), upright_m, 2e-5);
}

TEST(RestShape, what_nothing_holds_falls_freely_in_its_shape) {
  Scene scene = organ_scene();
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.tools.clear();
  scene.bodies[0].fixed.reset();
  scene.bodies[0].material.damping_per_s = 0;
  Operation op(scene);
  const double given_m3 = volume_m3(op), from_m = mean_height_m(op);
  op.rest(200);
  EXPECT_NEAR(from_m - mean_height_m(op), 0.5 * 9.81 * 0.2 * 0.2, 2e-3);
  EXPECT_NEAR(volume_m3(op) / given_m3, 1, 0.01);
}

TEST(RestShape, what_nothing_holds_lies_on_the_floor) {
  Scene scene = organ_scene();
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.tools.clear();
  scene.bodies[0].fixed.reset();
  scene.floor_z_m = -0.05;
  Operation op(scene);
  const double given_m3 = volume_m3(op), from_m = mean_height_m(op);
  op.rest(2000);
  EXPECT_GT(from_m - mean_height_m(op), 0.01);
  EXPECT_LT(from_m - mean_height_m(op), 0.05);
  EXPECT_NEAR(volume_m3(op) / given_m3, 1, 0.1);
}

// Volumes of a surface's component at rest and now.
struct Kept {
  double rest_m3 = 0, now_m3 = 0;
};
std::vector<Kept> kept_volumes(const Operation& op) {
  std::vector<Kept> kept;
  for (std::uint32_t b = 0; b < op.simulation.body_count(); ++b) {
    const TriangleMesh& mesh = op.mesh(b);
    const auto at = op.simulation.positions_world_m(b);
    const std::vector<std::uint32_t> component = component_of_triangle(mesh);
    const std::size_t first = kept.size();
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
      if (component[t] == kNone) continue;
      kept.resize(std::max(kept.size(), first + component[t] + 1));
      const auto& [x, y, z] = mesh.triangle(t).v;
      kept[first + component[t]].rest_m3 += mesh.rest_body_m(x).dot(mesh.rest_body_m(y).cross(mesh.rest_body_m(z))) / 6;
      kept[first + component[t]].now_m3 +=
          at[x].cast<double>().dot(at[y].cast<double>().cross(at[z].cast<double>())) / 6;
    }
  }
  return kept;
}

class FreedPiece : public testing::TestWithParam<FreeParts> {};
INSTANTIATE_TEST_SUITE_P(RestShape, FreedPiece, testing::Values(FreeParts::keep, FreeParts::deformable));

TEST_P(FreedPiece, keeps_its_volume) {
  Scene scene = loop_scene(GetParam());
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  Operation op(scene);
  cut_arc(op, 0, 375);
  lift(op);
  op.rest(1500);
  const std::vector<Kept> parts = kept_volumes(op);
  ASSERT_EQ(parts.size(), 2u);
  for (const Kept& part : parts) EXPECT_NEAR(part.now_m3 / part.rest_m3, 1, 0.1) << part.rest_m3;
}

TEST(RestShape, a_box_that_holds_no_vertex_holds_nothing) {
  Scene scene = organ_scene();
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.tools.clear();
  scene.bodies[0].fixed = Box{Vec3(5, 5, 5), Vec3(6, 6, 6)};
  Operation op(scene);
  const double from_m = mean_height_m(op);
  op.rest(100);
  EXPECT_GT(from_m - mean_height_m(op), 0.02);
}

}  // namespace
}  // namespace sectio::test
