// A bar that hangs from one end has turned: an instrument pushes it where the surface is now, not where it was at rest.
#include <gtest/gtest.h>

#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

constexpr double kLength_m = 0.1, kWidth_m = 0.012;

Scene hanging_bar(const std::string& model) {
  Scene scene = block_scene(model);
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.floor_z_m.reset();
  scene.sleep.after_s = 0;
  BodySpec& bar = scene.bodies[0];
  bar.mesh = box(10, 2, 2, Vec3(kLength_m, kWidth_m, kWidth_m));
  bar.pose.position_m = Vec3(0, -kWidth_m / 2, 0);
  bar.material.young_pa = 3000;
  bar.material.poisson = 0.4;
  bar.material.damping_per_s = 20;
  bar.cutting.threshold_force_n = 100;
  bar.fixed = Box{Vec3(-0.01, -1, -1), Vec3(0.015, 1, 1)};
  scene.tools.emplace_back();
  scene.tools[0].name = "scalpel";
  return scene;
}

// The vertex of the upper surface that is nearest to the middle line, and some way along the bar.
VertexId on_top(const Operation& op, double along_m) {
  const auto& rest = op.mesh().rest_body_m();
  const Vec3 place(along_m, kWidth_m / 2, kWidth_m);
  return static_cast<VertexId>(std::ranges::min_element(rest, {}, [&](const Vec3& x) { return (x - place).norm(); }) -
                               rest.begin());
}

class TurnedTissue : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, TurnedTissue, testing::Values("neo_hookean", "neo_hookean_lattice"));

TEST_P(TurnedTissue, is_pushed_the_way_that_the_hand_goes) {
  Operation op(hanging_bar(GetParam()));
  op.rest(1500);
  const VertexId touched = on_top(op, 0.08);
  const auto at_m = [&] { return Vec3(op.simulation.positions_world_m(0)[touched].cast<double>()); };
  const Vec3 hangs_m = at_m();
  ASSERT_LT(hangs_m.z(), -0.05) << "it hangs";
  // Its upper side looks to +x now, from where the tip comes. The bar has left the room of its beginning.
  const Eigen::Quaterniond aside(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY()));
  op.place(hangs_m + Vec3(0.02, 0.0007, 0.0005), aside);
  op.move(hangs_m + Vec3(-0.005, 0.0007, 0.0005));
  op.rest(200);
  ASSERT_EQ(op.state(), ContactState::contact);
  const Vec3 force_n = op.force_n();
  EXPECT_GT(force_n.x(), 0.7 * force_n.norm()) << force_n.transpose() << ": the normal of the beginning looks up";
  EXPECT_NEAR(at_m().x(), hangs_m.x() - 0.005, 0.002);
  EXPECT_NEAR(at_m().z(), hangs_m.z(), 0.006) << "it does not slide away";
}

}  // namespace
}  // namespace sectio::test
