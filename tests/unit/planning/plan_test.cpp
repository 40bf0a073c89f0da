#include "sim_server/planning/plan.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/calibration.h"
#include "tests/support/planning_methods.h"
#include "tests/support/shapes.h"

namespace sectio::planning {
namespace {

using test::calibration;
using test::methods;

PlanInput of_box(const Vec3& size_m, std::vector<BodyLoad> loads) {
  PlanInput in;
  in.body = "box";
  in.methods = methods();
  in.shape = shape_of(test::box(8, 8, 8, size_m));
  in.material.young_pa = 30000;
  in.loads = std::move(loads);
  in.surface_limit_s = 0.002;
  return in;
}
BodyLoad bending(double thickness_m) {
  return {{Load::bending, thickness_m, 0.45}, "its weight", true};
}
BodyLoad cut(double depth_m, double share) {
  return {{Load::opening, depth_m, 0.45, share}, "scalpel", false, share};
}

std::string why_not(const BodyPlan& plan, const std::string& method) {
  for (const auto& [m, why] : plan.ruled_out)
    if (m->name == method) return why;
  return "";
}

TEST(Shape, of_a_box_is_its_smallest_side) {
  const BodyShape shape = shape_of(test::box(10, 4, 4, Vec3(0.1, 0.03, 0.02)));
  EXPECT_NEAR(shape.thickness_m, 0.02, 1e-9);
  EXPECT_NEAR(shape.volume_m3, 6e-5, 1e-12);
  EXPECT_TRUE(shape.is_box);
  EXPECT_TRUE(shape.sharp_edges);
  EXPECT_TRUE(lies_on_cells(shape, 0.005));
  EXPECT_FALSE(lies_on_cells(shape, 0.006));
}

TEST(Shape, of_an_ellipsoid_is_no_box) {
  const BodyShape shape = shape_of(test::ellipsoid(3, Vec3(0.05, 0.05, 0.01)));
  EXPECT_FALSE(shape.is_box);
  EXPECT_FALSE(shape_of(test::ellipsoid(3, Vec3(0.05, 0.04, 0.03))).sharp_edges);
  EXPECT_FALSE(lies_on_cells(shape, 0.005));
  EXPECT_GT(shape.thickness_m, 0.01);
  EXPECT_LT(shape.thickness_m, 0.02) << "flat, whatever its rim";
}

TEST(Shape, line_has_a_chord_in_it) {
  const auto soup = test::box(3, 3, 3, Vec3(0.03, 0.03, 0.03));
  const auto found = chord(soup, Vec3(0.011, 0.013, 0.05), Vec3(0, 0, -1));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->enters, 0.02, 1e-12);
  EXPECT_NEAR(found->leaves, 0.05, 1e-12);
  EXPECT_FALSE(chord(soup, Vec3(0.05, 0.05, 0.05), Vec3(0, 0, -1)));
}

class Loads : public testing::Test {
 protected:
  std::vector<BodyLoad> loads() const { return loads_on(bar, shape_of(bar), situation); }
  void hold_end() {
    for (const Vec3& p : bar.vertices_body_m)
      if (p.x() == 0) situation.fixed_m.push_back(p);
    situation.most_gravity_m_per_s2 = 9.81;
  }
  ToolUse& add_tool(const Vec3& tip_m) {
    ToolUse use;
    use.name = "tool";
    ToolMoment m;
    m.tip_m = tip_m;
    m.back_m = tip_m + Vec3(0, 0, 0.1);
    use.moments = {m};
    situation.tools.push_back(use);
    return situation.tools.back();
  }

  TriangleSoup bar = test::box(10, 2, 2, Vec3(0.1, 0.02, 0.02));
  BodySituation situation;
};

TEST_F(Loads, weight_bends_what_hangs_over) {
  EXPECT_TRUE(loads().empty());
  hold_end();
  ASSERT_EQ(loads().size(), 1u);
  EXPECT_EQ(loads()[0].what.load, Load::bending);
  EXPECT_NEAR(loads()[0].what.width_m, 0.02, 1e-9);
  EXPECT_EQ(loads()[0].what.share, 1);
  situation.material.young_pa = 1e8;
  ASSERT_EQ(loads().size(), 1u);
  EXPECT_LT(loads()[0].what.share, 0.1) << "too stiff to sag much";
  EXPECT_GT(loads()[0].what.share, 0);
}

TEST_F(Loads, weight_pulls_at_what_hangs_and_presses_what_stands_or_lies) {
  situation.most_gravity_m_per_s2 = 9.81;
  const auto only = [&] {
    const auto all = loads();
    EXPECT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].what.load, Load::hanging);
    EXPECT_GT(all[0].what.share, 0);
    return all[0].from;
  };
  EXPECT_EQ(only(), "lies on the floor");
  situation.down_body = Vec3::UnitX();
  for (const Vec3& p : bar.vertices_body_m)
    if (p.x() == 0) situation.fixed_m.push_back(p);
  EXPECT_EQ(only(), "hangs");
  situation.down_body = -Vec3::UnitX();
  EXPECT_EQ(only(), "stands");
  situation.lies_on_floor = true;
  EXPECT_EQ(only(), "lies on the floor");
}

TEST_F(Loads, blade_opens_as_deep_as_it_goes) {
  add_tool(Vec3(0.051, 0.011, 0.015)).cuts = true;
  ASSERT_EQ(loads().size(), 1u);
  EXPECT_EQ(loads()[0].what.load, Load::opening);
  EXPECT_NEAR(loads()[0].what.width_m, 0.005, 1e-9);
  EXPECT_NEAR(loads()[0].depth_of_tissue, 0.25, 1e-9);
  situation.tools[0].moments[0].tip_m.z() = -0.01;
  EXPECT_NEAR(loads()[0].depth_of_tissue, 1, 1e-9);
  situation.tools[0].moments[0].tip_m.z() = 0.03;
  EXPECT_TRUE(loads().empty()) << "it never comes near";
  situation.tools[0].moments.clear();
  EXPECT_EQ(loads()[0].depth_of_tissue, 1) << "nobody knows what it will do";
}

TEST_F(Loads, blade_goes_so_far_so_deep_for_so_long) {
  const auto strokes = [&] { return strokes_in(bar, shape_of(bar), situation); };
  ToolUse& knife = add_tool(Vec3(0.031, 0.011, 0.03));
  knife.cuts = true;
  for (const auto& [x_m, z_m, time_s] :
       {std::array{0.031, 0.015, 1.0}, std::array{0.051, 0.015, 3.0}, std::array{0.051, 0.03, 4.0}}) {
    ToolMoment m = knife.moments[0];
    m.tip_m = Vec3(x_m, 0.011, z_m);
    m.back_m = m.tip_m + Vec3(0, 0, 0.1);
    m.time_s = time_s;
    knife.moments.push_back(m);
  }
  ASSERT_EQ(strokes().size(), 1u);
  EXPECT_NEAR(strokes()[0].area_m2, 0.02 * 0.005, 1e-9);
  EXPECT_NEAR(strokes()[0].way_m, 0.015 + 0.02, 1e-9) << "down, and along";
  EXPECT_NEAR(strokes()[0].time_s, 3, 1e-9);
  EXPECT_FALSE(strokes()[0].goes_through);
  situation.tools[0].cuts = false;
  EXPECT_TRUE(strokes().empty());
  situation.tools[0].cuts = true;
  situation.tools[0].moments.clear();
  ASSERT_EQ(strokes().size(), 1u) << "nobody knows what it will do";
  EXPECT_TRUE(strokes()[0].goes_through);
}

TEST_F(Loads, ball_dents_as_wide_as_it_touches) {
  add_tool(Vec3(0.051, 0.011, 0.02 + 0.005 - 0.002)).ball_radius_m = 0.005;
  ASSERT_EQ(loads().size(), 1u);
  EXPECT_EQ(loads()[0].what.load, Load::indentation);
  EXPECT_NEAR(loads()[0].what.width_m, 2 * std::sqrt(0.005 * 0.002), 1e-9);
}

TEST_F(Loads, forceps_hold_the_surface_in_their_reach) {
  ToolUse& tool = add_tool(Vec3(0.05, 0.01, 0.02));
  tool.grip_radius_m = 0.005;
  EXPECT_EQ(gripped_share(bar, situation), 0) << "they are open";
  tool.moments[0].grips = true;
  EXPECT_NEAR(gripped_share(bar, situation), M_PI * 0.005 * 0.005 / (2 * 0.02 * 0.02 + 4 * 0.1 * 0.02), 1e-3);
}

TEST_F(Loads, forceps_twist_when_they_turn) {
  ToolUse& tool = add_tool(Vec3(0.1, 0.01, 0.01));
  tool.grip_radius_m = 0.01;
  tool.moments[0].grips = true;
  EXPECT_EQ(loads().size(), 1u);
  tool.moments.push_back(tool.moments[0]);
  tool.moments[1].orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vec3::UnitX()));
  ASSERT_EQ(loads().size(), 2u);
  EXPECT_EQ(loads()[1].what.load, Load::twisting);
}

TEST(Plan, takes_the_cheapest_that_keeps_both_budgets) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {bending(0.025)});
  in.budgets = {0.05, 0.5};
  const BodyPlan p = plan(in, calibration());
  EXPECT_TRUE(p.fits);
  EXPECT_EQ(p.chosen.method->name, "lattice");
  EXPECT_LE(p.chosen.error, 0.05);
  EXPECT_EQ(why_not(p, "surface_springs"), "no error law for bending (its weight)");
  for (const Candidate& c : p.considered)
    if (c.error <= 0.05 && c.cpu <= 0.5) {
      EXPECT_LE(p.chosen.cpu, c.cpu);
    }
}

TEST(Plan, takes_finer_elements_for_a_smaller_error) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {{{Load::twisting, 0.025, 0.45}, "forceps"}});
  in.budgets = {0.3, 5};
  const BodyPlan coarse = plan(in, calibration());
  in.budgets.error = 0.05;
  const BodyPlan fine = plan(in, calibration());
  EXPECT_TRUE(coarse.fits && fine.fits);
  EXPECT_LT(fine.chosen.error, coarse.chosen.error);
  EXPECT_GT(fine.chosen.cpu, coarse.chosen.cpu);
}

TEST(Plan, leaves_shallow_incisions_to_the_surface) {
  PlanInput in = of_box({0.08, 0.08, 0.04}, {cut(0.008, 0.2)});
  in.loads[0].what.chi = 0.2;
  in.budgets = {0.5, 0.5};
  EXPECT_EQ(plan(in, calibration()).chosen.method->name, "surface_springs");
  in.loads = {cut(0.016, 0.4)};
  const BodyPlan deep = plan(in, calibration());
  EXPECT_NE(deep.chosen.method->name, "surface_springs");
  EXPECT_EQ(why_not(deep, "surface_springs"), "scalpel cuts deeper than 0.3 of the thickness");
}

TEST(Plan, counts_what_cuts_cost) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {cut(0.015, 0.6)});
  in.budgets = {0.3, 5};
  const Candidate uncut = plan(in, calibration()).chosen;
  EXPECT_EQ(uncut.cut_cpu, 0);
  in.strokes = {{"scalpel", 0.05, 0.05 * 0.015, 2.5, false}};
  const BodyPlan cut = plan(in, calibration());
  for (const Candidate& c : cut.considered) {
    EXPECT_GT(c.cut_cpu, c.cpu) << c.method->name;
    EXPECT_GT(c.cut_step_s, c.cut_cpu * c.step_s) << "not each step cuts";
  }
  EXPECT_NE(to_text(in, cut).find("a step that cuts: "), std::string::npos);
  in.strokes[0].time_s /= 2;
  EXPECT_GT(plan(in, calibration()).chosen.cut_cpu, cut.chosen.cut_cpu) << "twice as fast";
}

TEST(Plan, does_not_take_a_model_whose_cuts_are_too_dear) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {cut(0.015, 0.6)});
  in.strokes = {{"scalpel", 0.05, 0.05 * 0.015, 2.5, false}};
  in.budgets = {0.3, 100};
  const Candidate taken = plan(in, calibration()).chosen;
  in.budgets.cpu = 0.5 * (taken.cpu + taken.cut_cpu);
  const BodyPlan p = plan(in, calibration());
  EXPECT_TRUE(p.chosen.method != taken.method || p.chosen.cell_m != taken.cell_m) << to_text(in, p);
  if (!p.fits) {
    EXPECT_NE(to_text(in, p).find("over the budget"), std::string::npos);
  }
}

TEST(Plan, says_so_when_nothing_fits_and_takes_the_nearest) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {bending(0.025)});
  in.budgets = {1e-4, 1e-4};
  const BodyPlan p = plan(in, calibration());
  EXPECT_FALSE(p.fits);
  const double ratio = std::max(p.chosen.error, p.chosen.cpu) / 1e-4;
  for (const Candidate& c : p.considered) EXPECT_LE(ratio, std::max(c.error, c.cpu) / 1e-4 * (1 + 1e-9));
  EXPECT_NE(to_text(in, p).find("no model keeps error 0.0001 and cost 0.0001; taken: "), std::string::npos);
}

TEST(Plan, builds_what_it_takes_and_goes_on_when_it_is_dearer) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {bending(0.025)});
  in.budgets = {0.2, 0.5};
  const Candidate first = plan(in, calibration()).chosen;
  int built = 0;
  const BodyPlan p = plan(in, calibration(), [&](const Candidate& c) {
    ++built;
    const bool is_first = c.method == first.method && c.cell_m == first.cell_m;
    return Built{is_first ? 1e6 : c.elements, c.vertices, c.vertices, c.substeps};
  });
  EXPECT_GE(built, 2);
  EXPECT_TRUE(p.chosen.built);
  EXPECT_TRUE(p.chosen.method != first.method || p.chosen.cell_m != first.cell_m);
}

TEST(Plan, takes_what_is_unfit_only_if_all_are) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {bending(0.025)});
  in.budgets = {0.2, 0.5};
  const double coarse_m = 0.9 * plan(in, calibration()).chosen.cell_m;
  const auto built = [](const Candidate& c, bool unfit) {
    return Built{c.elements, c.vertices, c.vertices, c.substeps, {}, unfit ? "26 % of mass added" : ""};
  };
  const BodyPlan p = plan(in, calibration(), [&](const Candidate& c) { return built(c, c.cell_m > coarse_m); });
  EXPECT_LE(p.chosen.cell_m, coarse_m);
  EXPECT_EQ(p.chosen.unfit, "");
  const BodyPlan none = plan(in, calibration(), [&](const Candidate& c) { return built(c, true); });
  EXPECT_FALSE(none.fits);
  EXPECT_NE(to_text(in, none).find("26 % of mass added"), std::string::npos);
}

TEST(Plan, believes_what_was_weighed_more_than_a_law) {
  BodyLoad weight = bending(0.025);
  weight.is_weight = true;
  PlanInput in = of_box({0.1, 0.025, 0.025}, {weight});
  in.budgets = {0.1, 5};
  const Candidate by_law = plan(in, calibration()).chosen;
  ASSERT_LT(by_law.error, 0.1);
  int built = 0;
  const BodyPlan p = plan(in, calibration(), [&](const Candidate& c) {
    ++built;
    return Built{c.elements, c.vertices, c.vertices, c.substeps, 4000 * c.cell_m * c.cell_m};
  });
  EXPECT_EQ(p.chosen.error, 4000 * p.chosen.cell_m * p.chosen.cell_m);
  EXPECT_LE(p.chosen.error, 0.1);
  EXPECT_LT(p.chosen.cell_m, by_law.cell_m);
  EXPECT_LE(built, 8) << "what was weighed tells of the others of its method";
}

TEST(Plan, divides_stiff_tissue_into_more_parts) {
  PlanInput in = of_box({0.1, 0.025, 0.025}, {bending(0.025)});
  in.budgets = {0.05, 5};
  const int soft = plan(in, calibration()).chosen.substeps;
  in.material.young_pa = 3e6;
  EXPECT_GT(plan(in, calibration()).chosen.substeps, 5 * soft);
}

TEST(Plan, keeps_to_what_the_scene_rules_out) {
  PlanInput in = of_box({0.08, 0.08, 0.04}, {});
  EXPECT_EQ(plan(in, calibration()).chosen.method->name, "surface_springs") << "nothing is done to it";
  in.no_surface = "semi_progressive cuts tetrahedra";
  EXPECT_NE(plan(in, calibration()).chosen.method->name, "surface_springs");
  in.no_surface.clear();
  in.surface_limit_s = 1e-6;
  EXPECT_EQ(why_not(plan(in, calibration()), "surface_springs"),
            "the step needs more parts than it can be divided into");
}

TEST(Plan, divides_the_step_of_a_fine_surface) {
  PlanInput in = of_box({0.08, 0.08, 0.04}, {});
  const double whole = plan(in, calibration()).chosen.cpu;
  in.surface_limit_s = in.step_s / 3.5;
  const Candidate divided = plan(in, calibration()).chosen;
  EXPECT_EQ(divided.method->name, "surface_springs");
  EXPECT_EQ(divided.substeps, 4);
  EXPECT_NEAR(divided.cpu / whole, 4, 1e-9);
}

}  // namespace
}  // namespace sectio::planning
