// Bodies that rest sleep: they are where they were, to the bit, until something touches them.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

std::vector<Vec3f> positions(const Operation& op, std::uint32_t body = 0) {
  const auto now = op.simulation.positions_world_m(body);
  return {now.begin(), now.end()};
}
double apart_m(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  float most = 0;
  for (std::size_t v = 0; v < a.size(); ++v) most = std::max(most, (a[v] - b[v]).norm());
  return most;
}
// Steps until it sleeps, or all of them.
int steps_to_sleep(Operation& op, std::uint32_t body = 0, int most = 4000) {
  int n = 0;
  while (n < most && !op.simulation.asleep(body)) op.rest(1), ++n;
  return n;
}

// A block that is held from below and sags under its weight; a probe above it.
Scene sagging_block(const std::string& model) {
  Scene scene = block_scene(model);
  scene.bodies[0].fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1e-4)};
  scene.bodies[0].material.damping_per_s = 20;
  scene.tools.resize(1);
  scene.tools[0].kind = "probe";
  return scene;
}

class EachModel : public testing::TestWithParam<const char*> {};

TEST_P(EachModel, sleeps_where_it_would_have_stayed_and_wakes_by_a_touch) {
  Operation op(sagging_block(GetParam()));
  Scene restless = op.scene;
  restless.sleep.after_s = 0;
  Operation awake(restless);
  const int steps = steps_to_sleep(op);
  ASSERT_TRUE(op.simulation.asleep(0));
  EXPECT_EQ(op.last.report.bodies_asleep, 1u);
  EXPECT_TRUE(op.last.report.checks.at(0).asleep) << "the status says so";
  const auto asleep_at = positions(op);
  awake.rest(steps);
  EXPECT_EQ(apart_m(asleep_at, positions(awake)), 0) << "the same until then";
  op.rest(500);
  awake.rest(500);
  EXPECT_EQ(apart_m(asleep_at, positions(op)), 0);
  EXPECT_FALSE(awake.simulation.asleep(0));
  EXPECT_LT(apart_m(asleep_at, positions(awake)), 1e-4) << "what it missed";

  op.place({0, 0, 0.06});
  op.move({0, 0, 0.045}, 0.05);
  EXPECT_TRUE(op.simulation.asleep(0)) << "an instrument in the air";
  op.move({0, 0, 0.03}, 0.05);
  EXPECT_FALSE(op.simulation.asleep(0));
  EXPECT_GT(apart_m(asleep_at, positions(op)), 1e-3);
  op.move({0, 0, 0.08}, 0.1);
  steps_to_sleep(op);
  EXPECT_TRUE(op.simulation.asleep(0)) << "again";
  EXPECT_LT(apart_m(asleep_at, positions(op)), 3e-4);
}
INSTANTIATE_TEST_SUITE_P(Sleep, EachModel,
                         testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST(Sleep, a_tilt_wakes_all) {
  Operation op(sagging_block("neo_hookean"));
  steps_to_sleep(op);
  ASSERT_TRUE(op.simulation.asleep(0));
  StepInput tilt;
  tilt.gravity_m_per_s2 = Vec3(9.81, 0, 0);
  op.step(tilt);
  EXPECT_FALSE(op.simulation.asleep(0));
}

TEST(Sleep, only_what_nobody_touches) {
  Scene scene = organ_scene();
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies[1].name = "other";
  scene.bodies[1].pose.position_m = Vec3(0.3, 0, 0);
  Operation op(scene);
  op.tip_to(0, 0, -0.002);
  op.tip_to(0, 0, 0.002);
  op.rest(1000);
  EXPECT_FALSE(op.simulation.asleep(0));
  EXPECT_TRUE(op.simulation.asleep(1));
  EXPECT_EQ(op.last.report.bodies_asleep, 1u);
}

TEST(Sleep, what_cannot_be_seen_moving_from_the_camera_is_not_stepped) {
  std::array<int, 2> steps{};
  std::array<std::vector<Vec3f>, 2> at;
  for (std::size_t far = 0; far < 2; ++far) {
    Scene scene = sagging_block("tetra_springs");
    scene.bodies[0].material.damping_per_s = 4;
    scene.camera.eye_world_m = Vec3(0, far ? -20 : -0.2, 0.1);
    scene.camera.field_of_view_deg = 40;
    Operation op(scene);
    steps[far] = steps_to_sleep(op);
    ASSERT_TRUE(op.simulation.asleep(0));
    at[far] = positions(op);
  }
  EXPECT_LT(2 * steps[1], steps[0]);
  const double pixel_m = 20 * 40 * M_PI / 180 / 720;
  EXPECT_LT(apart_m(at[0], at[1]), 0.2 * pixel_m);
}

}  // namespace
}  // namespace sectio::test
