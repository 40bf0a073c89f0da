// A blade whose edge goes into tissue beside its tip, on a body that is cut where tips go.
#include <gtest/gtest.h>

#include "tests/support/operation.h"

namespace sectio::simulation_test {
namespace {

constexpr double kBlockSide_m = 0.1, kBlockTop_m = 0.03;  // the block's side at +x, and its top

Scene block_under_a_knife() {
  Scene scene = test::organ_scene();
  scene.bodies[0].mesh = test::box(10, 8, 3, Vec3(kBlockSide_m, 0.08, kBlockTop_m));
  scene.bodies[0].fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.005)};
  scene.tools[0].kind = "knife";
  scene.tools[0].geometry = instrument_of("knife").geometry;
  return scene;
}

// Its sharp side down, its heel over the block.
Eigen::Quaterniond lying() {
  Eigen::Matrix3d axes;
  axes << Vec3(0, 0, -1), Vec3(0, -1, 0), Vec3(-1, 0, 0);
  return Eigen::Quaterniond(axes);
}

TEST(GrazingBlade, a_tip_beside_the_body_is_a_remark_and_no_refused_cut) {
  test::Operation op(block_under_a_knife());
  const Vec3 above(kBlockSide_m + 0.01, 0.04, kBlockTop_m + 0.025);
  op.place(above, lying());
  op.move(above - Vec3(0, 0, 0.05));
  op.move(above);
  EXPECT_GE(op.count(EventKind::did_not_cut), 1u);
  EXPECT_EQ(op.count(EventKind::cut_refused), 0u);
  EXPECT_EQ(op.last.report.cuts_refused, 0u);
  EXPECT_EQ(op.walls(), 0u);
  for (const Event& e : op.events) {
    if (e.kind != EventKind::did_not_cut) continue;
    EXPECT_NE(e.text.find("the tip, which cuts in this style, is outside"), std::string::npos) << e.text;
  }
}

}  // namespace
}  // namespace sectio::simulation_test
