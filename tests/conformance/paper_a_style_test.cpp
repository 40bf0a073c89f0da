// Paper A's method and paper B's are two styles behind one plan_cut().
#include <gtest/gtest.h>

#include "tests/support/pad_under_scalpel.h"

namespace sectio::test {
namespace {

StrokeSettings with_templates() {
  StrokeSettings s;
  s.style = CutStyle::templates;
  return s;
}

TEST(A_STYLE, A_STYLE_templates_behind_plan_cut) {
  PadUnderScalpel templates(with_templates()), progressive;
  for (PadUnderScalpel* pad : {&templates, &progressive}) {
    pad->enter_at(0.012, 0.0143);
    for (double x = 0.012; x < 0.044; x += 0.0007) {
      const CutPlan plan = pad->go(x, 0.0143);
      ASSERT_EQ(plan.refused, 0u) << x;
      pad->expect_valid();
      ASSERT_TRUE(pad->going());
      // Where others see the instrument.
      const MeshDraft at(pad->mesh, {pad->positions.data(), pad->velocities.data()});
      EXPECT_LT((position_of(at, *pad->stroke()) - pad->top(x, 0.0143)).norm(), 0.0015);
    }
    pad->lift();
    pad->expect_valid();
    EXPECT_FALSE(pad->going());
    EXPECT_EQ(check(pad->mesh).euler_characteristic, 2);
  }
  EXPECT_FALSE(templates.cuts.grooves.fronts.empty());
  EXPECT_TRUE(progressive.cuts.grooves.fronts.empty());
  // Openings of their own width: tissue is parted as soon as it is cut.
  EXPECT_LT(check(templates.mesh).volume_m3, check(progressive.mesh).volume_m3 - 1e-9);
}

TEST(A_STYLE, A_STYLE_two_instruments_interleaved) {
  PadUnderScalpel pad(with_templates());
  pad.enter_at(0.012, 0.0143, 0);
  pad.enter_at(0.048, 0.0343, 1);
  for (int i = 0; i < 40; ++i) {
    const double d = 0.0007 * i;
    const CutPlan plan = pad.step({{0, {{pad.top(0.012 + d, 0.0143) - Vec3(0, 0, 0.004), Vec3::UnitZ(), 1e9}}, false},
                                   {1, {{pad.top(0.048 - d, 0.0343) - Vec3(0, 0, 0.005), Vec3::UnitZ(), 1e9}}, false}});
    ASSERT_EQ(plan.refused, 0u);
    pad.expect_valid();
  }
  const CutPlan plan = pad.step({{0, {}, true}, {1, {}, true}});
  EXPECT_EQ(plan.outcomes.size(), 2u);
  pad.expect_valid();
  EXPECT_TRUE(pad.cuts.template_strokes.empty());
}

}  // namespace
}  // namespace sectio::test
