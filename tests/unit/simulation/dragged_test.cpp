// A blade that leaves its cut takes tissue along, but not far; and pieces that lie in their beds are left there.
#include <gtest/gtest.h>

#include <utility>

#include "tests/support/block_scene.h"
#include "tests/support/gripper.h"
#include "tests/support/loop_cut.h"

namespace sectio::test {
namespace {

constexpr double kFrom_m = -0.012, kTo_m = 0.004;  // the ends of a cut along x

class DraggedBlade : public testing::Test {
 protected:
  DraggedBlade() : op(organ_scene()) {
    op.tip_to(kFrom_m, 0, -0.004);
    op.tip_to(kFrom_m, 0, kStrokeDepth_m);
    op.tip_to(kTo_m, 0, kStrokeDepth_m);
    EXPECT_EQ(op.state(), ContactState::penetration);
    op.after_each = [this](const StepOutput&) { farthest_m = std::max(farthest_m, op.farthest_from_rest_m()); };
  }
  double lips_end_m() const {  // the end of the cut
    double most = -1;
    for (const Triangle& t : op.mesh().triangles())
      if (t.alive() && t.surface == Surface::wall)
        for (const VertexId v : t.v) most = std::max(most, op.mesh().rest_body_m(v).x());
    return most;
  }

  Operation op;
  double farthest_m = 0;
};

TEST_F(DraggedBlade, sideways_the_tissue_slips_off_says_so_and_comes_back) {
  op.tip_to(kTo_m, 0.03, kStrokeDepth_m, 0.06);
  EXPECT_GT(farthest_m, 0.005) << "it goes along at first";
  EXPECT_LT(farthest_m, 0.02);
  EXPECT_EQ(text_of_last(op, EventKind::cut_ended), "it went aside, and the tissue slipped off");
  EXPECT_EQ(op.state(), ContactState::free);
  EXPECT_EQ(op.force_n().norm(), 0);
  const std::size_t walls = op.walls();
  op.rest(500);
  EXPECT_LT(op.farthest_from_rest_m(), 0.002);
  op.tip_to(kTo_m + 0.01, 0.03, kStrokeDepth_m);
  EXPECT_EQ(op.walls(), walls) << "nothing is cut until it has been lifted";
  op.tip_to(kTo_m + 0.01, 0.03, -0.004);
  op.tip_to(kTo_m + 0.01, 0.03, kStrokeDepth_m);
  op.tip_to(kTo_m + 0.02, 0.03, kStrokeDepth_m);
  EXPECT_GT(op.walls(), walls);
  EXPECT_EQ(op.count(EventKind::cut_refused), 0u);
  op.expect_valid();
}

TEST_F(DraggedBlade, that_goes_back_in_its_groove_and_on_again_goes_on_with_its_cut) {
  op.tip_to(kFrom_m + 0.001, 0, kStrokeDepth_m, 0.06);
  EXPECT_LT(farthest_m, 0.016);
  op.tip_to(kTo_m + 0.01, 0, kStrokeDepth_m);
  EXPECT_GT(lips_end_m(), kTo_m + 0.007);
  EXPECT_EQ(op.count(EventKind::cut_refused), 0u);
  op.expect_valid();
}

TEST(SunkBlade, deeper_than_its_edge_is_long_says_that_it_does_not_cut) {
  Scene scene = block_scene("surface_springs");
  scene.tools = organ_scene().tools;
  Operation op(scene);
  const double edge_m = op.scene.tools[0].geometry.c_tool_m.z();
  op.place(Vec3(-0.026, 0, kBlockTop_m + 0.005));
  op.move(Vec3(-0.026, 0, kBlockTop_m - edge_m - 0.003));
  op.move(op.hand().position_m + Vec3(0.01, 0, 0));
  EXPECT_GE(op.count(EventKind::did_not_cut), 1u);
  EXPECT_EQ(text_of_last(op, EventKind::did_not_cut),
            "all of its edge is beneath the surface, where its blunt part pushes");
  op.expect_valid();
}

class DraggedInVolume : public testing::TestWithParam<const char*> {
 protected:
  static constexpr double kDepth_m = 0.008;
  static Scene block(const std::string& model) {
    Scene scene = block_scene(model);
    scene.tools = organ_scene().tools;
    return scene;
  }
  // A slit along x, at whose end the blade stands.
  DraggedInVolume() : op(block(GetParam())) {
    op.place(Vec3(kFrom_m, 0, kBlockTop_m + 0.005));
    op.move(Vec3(kFrom_m, 0, kBlockTop_m - kDepth_m));
    op.move(Vec3(kTo_m, 0, kBlockTop_m - kDepth_m));
    EXPECT_EQ(op.state(), ContactState::penetration);
    EXPECT_LT(std::abs(op.force_n().y()), 0.1) << "straight on";
  }
  Operation op;
};
INSTANTIATE_TEST_SUITE_P(Models, DraggedInVolume,
                         testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(DraggedInVolume, a_blade_takes_a_wall_along_which_presses_it_back) {
  double before_n = op.force_n().y(), largest_jump_n = 0;
  op.after_each = [&](const StepOutput& out) {
    const double now_n = out.contacts.at(0).force_world_n.y();
    largest_jump_n = std::max(largest_jump_n, std::abs(now_n - std::exchange(before_n, now_n)));
  };
  op.move(op.hand().position_m + Vec3(0, 0.004, 0), 0.01);
  EXPECT_LT(op.force_n().y(), -0.05);
  EXPECT_GT(op.farthest_from_rest_m(), 0.002) << "half of its way";
  op.move(op.hand().position_m - Vec3(0, 0.004, 0), 0.01);
  EXPECT_LT(std::abs(op.force_n().y()), 0.05);
  EXPECT_LT(largest_jump_n, 0.1);
  op.move(op.hand().position_m + Vec3(0, 0, 0.02));
  EXPECT_EQ(op.state(), ContactState::free);
  op.expect_valid();
}

TEST_P(DraggedInVolume, a_blade_that_cuts_at_a_slant_has_not_gone_aside) {
  op.move(op.hand().position_m + 0.02 * Vec3(std::cos(0.4), std::sin(0.4), 0));
  op.move(op.hand().position_m - 0.001 * Vec3(std::cos(0.4), std::sin(0.4), 0));
  EXPECT_EQ(op.state(), ContactState::penetration);
  EXPECT_EQ(op.count(EventKind::cut_ended), 0u);
  op.expect_valid();
}

TEST_P(DraggedInVolume, tissue_slips_off_a_blade_that_goes_far_aside_and_says_so) {
  op.move(op.hand().position_m + Vec3(0, 0.025, 0), 0.05);
  EXPECT_EQ(text_of_last(op, EventKind::cut_ended), "it went aside, and the tissue slipped off");
  EXPECT_EQ(op.force_n().norm(), 0);
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
  op.expect_valid();
}

// A stroke at the depth of the loop, from outside through the piece.
void cut_across(Operation& op) {
  op.tip_to(-0.022, 0, -0.01, 0.1);
  op.tip_to(-0.022, 0, 0.004);
  op.tip_to(0.022, 0, 0.004);
  op.tip_to(0.022, 0, -0.01);
  op.rest(300);
}

double piece_moved_m(const Operation& op) {
  Vec3 now = Vec3::Zero(), rest = Vec3::Zero();
  const auto at = op.simulation.positions_world_m(1);
  for (VertexId v = 0; v < op.mesh(1).vertex_slots(); ++v) {
    now += at[v].cast<double>();
    rest += op.simulation.body(1).pose.to_world(op.mesh(1).rest_body_m(v));
  }
  return (now - rest).norm() / op.mesh(1).vertex_slots();
}

TEST(RigidPiece, a_blade_goes_through_it_says_so_and_doesn_t_push_it_through_the_wall) {
  Scene scene = loop_scene(FreeParts::rigid);
  scene.bodies[0].cutting.threshold_force_n = 0.05;
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  Operation op(scene);
  cut_arc(op, 0, 375);
  lift(op);
  ASSERT_EQ(op.simulation.body_count(), 2u);
  cut_across(op);
  EXPECT_LT(piece_moved_m(op), 0.004);
  for (const BodyOverlap& overlap : op.simulation.overlaps()) EXPECT_LT(overlap.deepest_m, 0.002);
  EXPECT_TRUE(std::ranges::any_of(op.events, [](const Event& e) {
    return e.body_id == 1 && e.text == "a part that moves as a whole isn't cut: the blade goes through it";
  }));
}

TEST(KeptPiece, lies_still_where_nothing_touches_it) {
  Scene scene = loop_scene(FreeParts::keep);
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  Operation op(scene);
  cut_arc(op, 0, 375);
  lift(op);
  op.rest(1000);
  const auto at = op.simulation.positions_world_m(0);
  const std::vector<Vec3f> before(at.begin(), at.end());
  op.rest(6000);
  double most_m = 0;
  for (VertexId v = 0; v < before.size(); ++v)
    if (op.mesh().vertex_alive(v))
      most_m = std::max(most_m, double{(op.simulation.positions_world_m(0)[v] - before[v]).norm()});
  EXPECT_LT(most_m, 5e-4);
}

}  // namespace
}  // namespace sectio::test
