// Paper B, 5.1: the cut follows the instrument by a temporary subdivision.
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "tests/support/pad_under_scalpel.h"

namespace sectio::test {
namespace {

// The same edits on the revision of a mesh that has gone on, for apply().
TopologyDelta rebased(TopologyDelta delta, const TriangleMesh& mesh) {
  delta.base_revision = mesh.revision();
  delta.revision = mesh.revision() + 1;
  return delta;
}

// The mesh with every temporary subdivision undone, in the order in which the strokes will undo theirs.
TriangleMesh without_temporaries(const PadUnderScalpel& pad) {
  TriangleMesh mesh = pad.mesh;
  MeshDraft draft(pad.mesh, pad.view());
  for (auto s = pad.cuts.strokes.rbegin(); s != pad.cuts.strokes.rend(); ++s)
    EXPECT_TRUE(!s->temporary_inverse || draft.undo(*s->temporary_inverse));
  const TopologyDelta delta = draft.delta();
  EXPECT_TRUE(delta.empty() || apply(delta, mesh) == ApplyStatus::applied);
  return mesh;
}

const std::vector<std::array<double, 2>> kWander{
    {0.0215, 0.0145}, {0.0221, 0.0152}, {0.0213, 0.0161}, {0.0207, 0.0149}, {0.0222, 0.0141}};

// In over x = 20 mm at y = 15 mm, into the face above the diagonal of cell 2, 1.
void come_to_cell(PadUnderScalpel& pad) {
  pad.enter_at(0.011, 0.015);
  for (const double x : {0.011, 0.014, 0.018, 0.021}) pad.go(x, 0.015);
}

TEST(B_PROG, B_PROG_1_moving_in_a_triangle_moves_vertices_only) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  const auto triangles = pad.mesh.triangle_count();
  for (const auto& [x, y] : kWander) {
    const CutPlan plan = pad.go(x, y);
    EXPECT_TRUE(plan.delta.triangles.empty());
    EXPECT_EQ(plan.delta.vertices.size(), 2u) << "the tip on the surface and the bottom beneath it";
    EXPECT_EQ(pad.mesh.triangle_count(), triangles);
    pad.expect_valid();
  }
}

TEST(B_PROG, B_PROG_1_the_temporary_subdivision_is_that_of_an_end_triangle) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  EXPECT_EQ(pad.skin().at({2, 1, true}).size(), 4u);
}

TEST(B_PROG, B_PROG_2_without_the_temporary_subdivision_the_database_is_bit_for_bit_what_it_was) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  const TriangleMesh permanent = without_temporaries(pad);
  EXPECT_EQ(permanent.triangle_count() + 6, pad.mesh.triangle_count()) << "two of skin and four of the groove";
  for (const auto& [x, y] : kWander) {
    pad.go(x, y);
    const TriangleMesh again = without_temporaries(pad);
    EXPECT_TRUE(again.same_database(permanent));
    EXPECT_EQ(again.hash(), permanent.hash());
  }
  pad.go(0.026, 0.0155);  // into the next face: this one is subdivided anew, as midway
  pad.expect_valid();
  EXPECT_EQ(pad.skin().at({2, 1, true}).size(), 3u);
  EXPECT_EQ(pad.skin().at({2, 1, false}).size(), 4u);
}

TEST(B_PROG, B_PROG_2_all_deltas_undone_give_back_the_first_database) {
  PadUnderScalpel pad;
  const TriangleMesh first = pad.mesh;
  std::vector<TopologyDelta> back;
  TriangleMesh replica = pad.mesh;
  const auto record = [&](const CutPlan& plan) {
    if (plan.delta.empty()) return;
    back.push_back(inverse(plan.delta, replica));
    ASSERT_EQ(apply(plan.delta, replica), ApplyStatus::applied);
    ASSERT_TRUE(replica.same_database(pad.mesh));
  };
  pad.enter_at(0.011, 0.015);
  for (int i = 0; i < 120; ++i)
    record(pad.go(0.011 + 4e-4 * i, 0.016 + 0.009 * std::sin(0.11 * i), 0.003 + 0.002 * std::sin(0.05 * i)));
  record(pad.lift());
  EXPECT_GT(back.size(), 100u);
  EXPECT_FALSE(replica.same_database(first));
  for (auto it = back.rbegin(); it != back.rend(); ++it)
    ASSERT_EQ(apply(rebased(*it, replica), replica), ApplyStatus::applied);
  EXPECT_TRUE(replica.same_database(first));
  EXPECT_EQ(replica.hash(), first.hash());
}

TEST(B_PROG, B_PROG_2_moving_on_leaves_no_vertex_of_the_temporary_subdivision) {
  PadUnderScalpel wanders, goes;
  come_to_cell(wanders);
  for (const auto& [x, y] : kWander) wanders.go(x, y);
  come_to_cell(goes);
  for (PadUnderScalpel* pad : {&wanders, &goes}) {
    pad->go(0.026, 0.015);
    pad->lift();
    pad->expect_valid();
  }
  EXPECT_EQ(wanders.mesh.vertex_count(), goes.mesh.vertex_count());
  EXPECT_EQ(wanders.mesh.vertex_slots(), goes.mesh.vertex_slots()) << "slots are used again";
  EXPECT_EQ(wanders.mesh.triangle_count(), goes.mesh.triangle_count());
}

TEST(B_PROG, B_PROG_3_pulling_out_keeps_the_end_triangle_and_the_last_intersection) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  pad.go(0.022, 0.0156);
  const TriangleMesh before = pad.mesh;
  const CutPlan plan = pad.lift();
  EXPECT_TRUE(plan.delta.empty()) << "what is open stays as it is";
  EXPECT_TRUE(pad.mesh.same_database(before));
  EXPECT_FALSE(pad.going());
  EXPECT_EQ(pad.skin().at({2, 1, true}).size(), 4u);
  const VertexId last = pad.only_vertex_at(pad.top(0.022, 0.0156));
  ASSERT_NE(last, kNone);
  EXPECT_TRUE(pad.cuts.grooves.ends.contains(last));
}

TEST(B_PROG, B_PROG_3_lifted_by_its_own_motion) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  pad.go(0.022, 0.0156);
  const CutPlan plan = pad.go(0.0225, 0.0157, -0.001);  // the tip a millimetre above the surface
  ASSERT_EQ(plan.outcomes.size(), 1u);
  EXPECT_EQ(plan.outcomes[0].end, StrokeEnd::lifted);
  EXPECT_FALSE(pad.going());
  pad.expect_valid();
  EXPECT_EQ(pad.skin().at({2, 1, true}).size(), 4u);
}

TEST(B_PROG, B_PROG_4_the_end_of_the_cut_is_where_the_instrument_is) {
  PadUnderScalpel pad;
  pad.enter_at(0.011, 0.015);
  // In the corner of a triangle the inset is along two edges, at most.
  const double tolerance_m = 2 * pad.settings.inset * PadUnderScalpel::kCell_m * std::sqrt(2.0);
  double largest_m = 0;
  int exact = 0, steps = 0;
  for (int i = 1; i < 300; ++i, ++steps) {
    const double x = 0.011 + 1.5e-4 * i, y = 0.016 + 0.009 * std::sin(0.04 * i);
    pad.go(x, y);
    ASSERT_TRUE(pad.going());
    const VertexId end = pad.stroke()->temporary_tip;
    ASSERT_NE(end, kNone) << "open in every step";
    const double lag_m = (pad.mesh.rest_body_m(end) - pad.top(x, y)).norm();
    largest_m = std::max(largest_m, lag_m);
    exact += lag_m < 1e-7;
  }
  EXPECT_LT(largest_m, tolerance_m) << "only the inset from the triangle's rim";
  EXPECT_GT(exact, steps / 2) << "none away from the rim";
}

TEST(B_PROG, turning_in_a_triangle) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  for (int i = 0; i < 60; ++i) {  // round and round within the face
    const double angle = 0.4 * i;
    pad.go(0.0225 + 0.0015 * std::cos(angle), 0.0165 + 0.0015 * std::sin(angle));
    ASSERT_NO_FATAL_FAILURE(pad.expect_valid());
    EXPECT_EQ(pad.skin().at({2, 1, true}).size(), 4u);
  }
  EXPECT_TRUE(pad.going());
  EXPECT_EQ(pad.refused, 0u);
}

TEST(B_PROG, an_edge_that_leans_and_is_drawn_out_leaves_its_cut_as_long_as_it_is) {
  const Vec3 leaning = Vec3(0.5, 0, 1).normalized();  // over the way ahead: the skin is cut before the tip is there
  for (const Vec3& out : {Vec3(Vec3::UnitZ()), leaning}) {
    PadUnderScalpel pad;
    pad.enter_at(0.011, 0.015);
    Vec3 tip = pad.top(0.008, 0.015) - 0.004 * Vec3::UnitZ();
    const auto go = [&] { pad.step({{0, {{tip, leaning, 1e9}}}}); };
    for (int i = 0; i < 40; ++i, tip.x() += 3e-4) go();
    ASSERT_TRUE(pad.going());
    const double end_m = pad.mesh.rest_body_m(pad.stroke()->temporary_tip).x();
    for (int i = 0; i < 14; ++i, tip += 3e-4 * out) go();
    double farthest_m = 0;
    for (const auto& [v, bottom] : pad.cuts.grooves.rungs)
      farthest_m = std::max(farthest_m, pad.mesh.rest_body_m(v).x());
    if (pad.going() && pad.stroke()->temporary_tip != kNone)
      farthest_m = std::max(farthest_m, pad.mesh.rest_body_m(pad.stroke()->temporary_tip).x());
    EXPECT_GT(farthest_m, end_m - 3e-4);
    pad.expect_valid();
  }
}

TEST(B_PROG, retreating_over_the_cut_itself) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  for (double x = 0.021; x > 0.012; x -= 5e-4) {
    pad.go(x, 0.015);
    ASSERT_NO_FATAL_FAILURE(pad.expect_valid());
  }
  if (pad.going()) pad.lift();
  pad.expect_valid();
  EXPECT_EQ(pad.refused + pad.rejected_deltas, 0u);
}

// The tissue beneath a blade moves, and carries the cut along.
void carry(PadUnderScalpel& pad, const Vec3& way_m) {
  for (std::size_t v = 0; v < pad.particles.size(); ++v) pad.particles.place(v, pad.view().position(v) + way_m);
}

TEST(B_PROG, a_blade_that_is_drawn_out_leaves_the_end_where_it_is) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  pad.go(0.0225, 0.015);
  const Vec3 end = pad.mesh.rest_body_m(pad.stroke()->temporary_tip);
  for (int i = 1; i < 10; ++i) {
    carry(pad, Vec3(1e-4, 0, 0));  // the tissue that it had pushed comes back
    pad.go(0.0225, 0.015, 0.004 - 4e-4 * i);
    ASSERT_NO_FATAL_FAILURE(pad.expect_valid());
    ASSERT_TRUE(pad.going());
    EXPECT_EQ(pad.mesh.rest_body_m(pad.stroke()->temporary_tip), end);
  }
  EXPECT_EQ(pad.refused, 0u);
}

TEST(B_PROG, a_blade_that_goes_on_is_not_followed_to_where_tissue_swings_aside) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  pad.go(0.0225, 0.015);
  const Vec3 end = pad.mesh.rest_body_m(pad.stroke()->temporary_tip);
  carry(pad, Vec3(1.6e-4, -2e-4, 0));
  pad.go(0.0225 + 1.6e-4, 0.015);
  EXPECT_EQ(pad.mesh.rest_body_m(pad.stroke()->temporary_tip), end);
  pad.go(0.0225 + 8e-4, 0.015);
  EXPECT_GT((pad.mesh.rest_body_m(pad.stroke()->temporary_tip) - end).x(), 5e-4) << "ahead of the end it is";
  pad.expect_valid();
}

TEST(B_PROG, a_touch_without_motion_cuts_nothing) {
  PadUnderScalpel pad;
  const TriangleMesh before = pad.mesh;
  pad.enter_at(0.011, 0.015);
  pad.go(0.011, 0.015);
  pad.go(0.011 + 5e-5, 0.015);
  pad.lift();
  EXPECT_TRUE(pad.mesh.same_database(before));
}

TEST(B_PROG, start_and_end_in_one_triangle) {
  PadUnderScalpel pad;
  pad.draw({{0.012, 0.016}, {0.0125, 0.0165}, {0.013, 0.018}});
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
  EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u);
  EXPECT_EQ(pad.walls().size(), 8u);
}

TEST(B_PROG, a_stroke_that_cannot_begin_is_refused_alone) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  const TriangleMesh before = pad.mesh;
  pad.entries.push_back({1, pad.mesh.triangle_slots() + 7, Vec3(0.3, 0.3, 0.4)});  // a triangle that isn't there
  const CutPlan plan = pad.step({{0, {{pad.top(0.026, 0.015) - 0.004 * Vec3::UnitZ(), Vec3::UnitZ(), 1e9}}, false},
                                 {1, {{pad.top(0.028, 0.015) - 0.004 * Vec3::UnitZ(), Vec3::UnitZ(), 1e9}}, false}});
  EXPECT_EQ(plan.refused, 1u) << "counted";
  ASSERT_EQ(plan.outcomes.size(), 1u);
  EXPECT_EQ(plan.outcomes[0].edge_id, 1u);
  EXPECT_FALSE(plan.delta.empty()) << "the other one goes on";
  EXPECT_TRUE(pad.going());
  EXPECT_FALSE(pad.mesh.same_database(before));
  pad.expect_valid();
}

TEST(B_PROG, a_delta_that_does_not_fit_leaves_the_mesh_alone) {
  PadUnderScalpel pad;
  come_to_cell(pad);
  const TriangleMesh before = pad.mesh;
  SurfaceCutPlan plan =
      plan_cut(pad.mesh, pad.view(), pad.cuts, {},
               pad.over_all({{0, {{pad.top(0.026, 0.015), Vec3::UnitZ(), 1e9}}, false}}), pad.settings, true);
  ASSERT_FALSE(plan.delta.empty());
  plan.delta.hash_after ^= 1;
  EXPECT_FALSE(pad.accept(plan));
  EXPECT_TRUE(pad.mesh.same_database(before));
  EXPECT_FALSE(pad.going()) << "the stroke ends with what is open";
  EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u);
}

}  // namespace
}  // namespace sectio::test
