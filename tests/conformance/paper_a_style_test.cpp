// The methods of papers A and B are two styles behind one plan_cut().
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/session/recorder.h"
#include "sim_server/surface/surface_engines.h"
#include "tests/support/operation.h"
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
      // The place at which the rest of the simulation sees the instrument.
      const MeshDraft at(pad->mesh, pad->view());
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

TEST(A_STYLE, A_STYLE_a_refused_cut_says_why) {
  for (const StrokeSettings& settings : {with_templates(), StrokeSettings{}}) {
    PadUnderScalpel pad(settings), other(settings);
    pad.enter_at(0.012, 0.0143);
    for (double x = 0.012; x < 0.034; x += 0.0007) pad.go(x, 0.0143);
    ASSERT_TRUE(pad.going());
    other.cuts = pad.cuts;
    const CutPlan plan = other.go(0.035, 0.0143);
    ASSERT_EQ(plan.outcomes.size(), 1u);
    EXPECT_EQ(plan.outcomes[0].end, StrokeEnd::refused);
    EXPECT_EQ(plan.outcomes[0].why, kChangedBeneath);
  }
  // Back along its cut a blade cuts nothing; beside it, that is no cut that templates can make.
  for (const double beside_m : {0.0, 0.004}) {
    PadUnderScalpel back(with_templates());
    back.enter_at(0.012, 0.0143);
    for (double x = 0.012; x < 0.034; x += 0.0007) back.go(x, 0.0143);
    std::string_view why;
    for (double x = 0.034; x > 0.016 && why.empty(); x -= 0.0007)
      for (const StrokeOutcome& o : back.go(x, 0.0143 + beside_m).outcomes) why = o.why;
    EXPECT_EQ(why, beside_m > 0 ? "the blade goes back from where its cut has come to" : "");
    back.expect_valid();
  }
}

// Lets no blade in.
class NoEntry final : public CuttingEngine {
 public:
  CutTraits traits() const override { return {}; }
  CutPlan plan(const SharedBody&, std::span<const Entry> entries, std::span<const BladeMotion>) const override {
    CutPlan plan;
    for (const Entry& e : entries) plan.outcomes.push_back({e.edge_id, StrokeEnd::refused, "no entry"});
    plan.refused = static_cast<std::uint32_t>(entries.size());
    return plan;
  }
  void follow(const SharedBody&, const TopologyChange&) override {}
};

TEST(A_STYLE, A_STYLE_events_and_report_say_why_a_cut_was_refused) {
  EngineTable table = standard_engines();
  table.model("surface_springs").make = [](const EngineSite& site) {
    BodyEngines engines = surface_spring_engines(site);
    engines.cutting = std::make_unique<NoEntry>();
    return engines;
  };
  Operation op(organ_scene(), table);
  Recorder record(op.scene, op.simulation, "");
  op.after_each = [&](const StepOutput& out) { record.add(out, 0.001); };
  op.place({0, 0.001, kOrganTop_m + 0.004});
  op.tip_to(0, 0.001, 0.008);
  ASSERT_GE(op.count(EventKind::cut_refused), 1u);
  for (const Event& e : op.events) EXPECT_EQ(e.text, e.kind == EventKind::cut_refused ? "no entry" : "");
  EXPECT_NE(record.finish().report.find("\"no entry\": "), std::string::npos);
}

}  // namespace
}  // namespace sectio::test
