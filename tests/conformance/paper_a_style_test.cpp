// The methods of papers A and B are two styles of cutting behind one interface.
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/session/recorder.h"
#include "sim_server/surface/surface_engines.h"
#include "tests/support/operation.h"
#include "tests/support/pad_under_scalpel.h"

namespace sectio::test {
namespace {

// The same pad under an instrument that cuts with templates.
class PadUnderTemplates : public TemplatesOnMesh {
 public:
  PadUnderTemplates() : TemplatesOnMesh(box(6, 4, 2, Vec3(0.06, 0.04, PadUnderScalpel::kTop_m))) {}
  static Vec3 top(double x_m, double y_m) { return PadUnderScalpel::top(x_m, y_m); }
  void enter_at(double x_m, double y_m, std::uint32_t edge_id = 0) {
    entries.push_back(entry_from_above(mesh, top(x_m, y_m), edge_id));
  }
  CutPlan go(double x_m, double y_m) { return to(top(x_m, y_m), Vec3::UnitZ(), 0.004); }
};

// The place at which the rest of the simulation sees the instrument.
Vec3 place_of(const PadUnderTemplates& pad) {
  return pad.stroke()->place.point_world_m;
}
Vec3 place_of(const PadUnderScalpel& pad) {
  return position_of(MeshDraft(pad.mesh, pad.view()), *pad.stroke());
}

template <class Pad>
void stroke_along(Pad& pad) {
  pad.enter_at(0.012, 0.0143);
  for (double x = 0.012; x < 0.044; x += 0.0007) {
    const CutPlan plan = pad.go(x, 0.0143);
    ASSERT_EQ(plan.refused, 0u) << x;
    pad.expect_valid();
    ASSERT_TRUE(pad.going());
    EXPECT_LT((place_of(pad) - pad.top(x, 0.0143)).norm(), 0.0015);
  }
  pad.lift();
  pad.expect_valid();
  EXPECT_FALSE(pad.going());
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
}

TEST(A_STYLE, A_STYLE_two_styles_make_the_same_stroke) {
  PadUnderTemplates templates;
  PadUnderScalpel progressive;
  stroke_along(templates);
  stroke_along(progressive);
  EXPECT_FALSE(templates.cuts.grooves.fronts.empty());
  EXPECT_TRUE(progressive.cuts.grooves.fronts.empty());
  // Openings of their own width: tissue is parted as soon as it is cut.
  EXPECT_LT(check(templates.mesh).volume_m3, check(progressive.mesh).volume_m3 - 1e-9);
}

TEST(A_STYLE, A_STYLE_two_instruments_interleaved) {
  PadUnderTemplates pad;
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
  EXPECT_TRUE(pad.cuts.strokes.empty());
}

// The cuts of one pad don't fit another.
template <class Pad>
void cut_beneath_another_ones_cuts() {
  Pad pad, other;
  pad.enter_at(0.012, 0.0143);
  for (double x = 0.012; x < 0.034; x += 0.0007) pad.go(x, 0.0143);
  ASSERT_TRUE(pad.going());
  other.cuts = pad.cuts;
  const CutPlan plan = other.go(0.035, 0.0143);
  ASSERT_EQ(plan.outcomes.size(), 1u);
  EXPECT_EQ(plan.outcomes[0].end, StrokeEnd::refused);
  EXPECT_EQ(plan.outcomes[0].why, kChangedBeneath);
}

TEST(A_STYLE, A_STYLE_a_refused_cut_says_why) {
  cut_beneath_another_ones_cuts<PadUnderTemplates>();
  cut_beneath_another_ones_cuts<PadUnderScalpel>();
  // Back along its cut a blade cuts nothing; beside it, that is no cut that templates can make.
  for (const double beside_m : {0.0, 0.004}) {
    PadUnderTemplates back;
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
