// A scalpel, whose edge leans, turns in a corner of its stroke: the place where it meets the skin goes about the tip.
#include <gtest/gtest.h>

#include "sim_server/session/run_outcome.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

// From an edge that stands at `tip_m` and leads along `up`.
double to_nearest_wall_m(const Operation& op, const Vec3& tip_m, const Vec3& up) {
  double least_m = 1;
  for (const Triangle& t : op.mesh().triangles()) {
    if (!t.alive() || t.surface != Surface::wall) continue;
    for (const VertexId v : t.v) {
      const Vec3 from_tip = op.scene.bodies[0].pose.to_world(op.mesh().rest_body_m(v)) - tip_m;
      least_m = std::min(least_m, (from_tip - from_tip.dot(up) * up).norm());
    }
  }
  return least_m;
}

class TurningBlade : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Corners, TurningBlade, testing::Values(-140, -120, -90, 90, 120, 140));

TEST_P(TurningBlade, goes_on_from_its_corner) {
  Scene scene = organ_scene();
  scene.bodies[0].mesh = ellipsoid(5, Vec3(0.06, 0.06, kOrganTop_m));
  Operation op(scene);
  const RunOutcome outcome(op.simulation);
  const auto heading = [](double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Vec3::UnitZ())); };
  const double to_rad = GetParam() * M_PI / 180;
  op.place(Vec3(-0.02, -0.008, kOrganTop_m + 0.005), heading(0));
  op.tip_to(-0.02, -0.008, 0.005);
  op.tip_to(0.01, -0.008, 0.005);
  const Vec3 corner = op.hand().position_m;
  constexpr int kTurn = 200;
  for (int n = 1; n <= kTurn; ++n) op.place(corner, heading(n * to_rad / kTurn));
  op.tip_to(0.01 + 0.02 * std::cos(to_rad), -0.008 + 0.02 * std::sin(to_rad), 0.005);
  op.expect_valid();
  const ToolGeometry& g = op.scene.tools[0].geometry;
  const Vec3 leans = (g.c_tool_m - g.a_tool_m).normalized();
  // The skin that the edge came over has been cut, from the corner on.
  for (const double way_m : {0.002, 0.006, 0.01}) {
    const Vec3 tip = corner + way_m * Vec3(std::cos(to_rad), std::sin(to_rad), 0);
    EXPECT_LT(to_nearest_wall_m(op, tip, heading(to_rad) * leans), 0.002) << way_m;
  }
  EXPECT_EQ(outcome.finish({}).incisions, 1);
}

}  // namespace
}  // namespace sectio::test
