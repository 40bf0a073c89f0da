// Paper C, 3.1: the ball of an instrument and its grip on tissue, for every model.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "sim_server/body_contact/rigid_body.h"
#include "tests/support/gripper.h"
#include "tests/support/loop_cut.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

class Grasp : public testing::TestWithParam<std::string> {
 protected:
  // At rest under gravity, jaws closed on its top in the middle.
  void grasp(Operation& op, Gripper& gripper) {
    op.rest(600);
    before = positions_of(op);
    gripper.move(Vec3(0, 0, kBlockTop_m - 0.001) - gripper.tips_m(), 60);
    gripper.close();
    ASSERT_EQ(op.count(EventKind::grasped), 1u);
  }
  std::vector<Vec3> before;
};
INSTANTIATE_TEST_SUITE_P(C_CON, Grasp,
                         testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"));

const Vec3 kAbove(0.001, 0.0005, kBlockTop_m + 0.01);

TEST_P(Grasp, C_CON_4_points_in_the_sphere_follow_the_hand_by_a_force) {
  Operation op(block_with_forceps(GetParam()));
  Gripper gripper(op, 0, kAbove);
  grasp(op, gripper);
  const std::vector<Vec3> closed = positions_of(op);
  const Vec3 tips = gripper.tips_m(), by(0.002, 0, 0.004);
  gripper.move(by, 200);
  op.rest(200);
  EXPECT_EQ(op.count(EventKind::released), 0u);
  int held = 0, left = 0;
  const std::vector<Vec3> now = positions_of(op);
  for (std::size_t v = 0; v < now.size(); ++v) {
    const double from_tips = (closed[v] - tips).norm(), off = (now[v] - closed[v] - by).norm();
    if (from_tips < 0.0075) {
      ++held;
      EXPECT_LT(off, 1e-4) << "held";
    } else if (from_tips > 0.012) {
      ++left;
      EXPECT_GT(off, 2e-4) << "not held";
    }
  }
  EXPECT_GE(held, 3);
  EXPECT_GT(left, 20);
  EXPECT_LT(op.force_n().z(), -0.01) << "it pulls the hand down";
  EXPECT_LE(op.force_n().norm(), 2.0);
  // The force that the bridge evaluates pulls, too.
  const ContactModel& felt = op.last.contacts[0];
  EXPECT_EQ(felt.state, ContactState::held);
  EXPECT_GT(felt.side_stiffness_n_per_m, 0);
}

TEST_P(Grasp, C_CON_5_a_hand_that_jumps_away_leaves_the_tissue) {
  Operation op(block_with_forceps(GetParam()));
  Gripper gripper(op, 0, kAbove);
  grasp(op, gripper);
  const double energy_j = op.simulation.energy_j(), work_j = op.last.report.instrument_work_j;
  gripper.jump(Vec3(0.5, 0, 0));
  EXPECT_EQ(text_of_last(op, EventKind::released), "slipped");
  for (int n = 0; n < 300; ++n) {
    op.rest(1);
    EXPECT_LT(op.simulation.energy_j(), energy_j + op.last.report.instrument_work_j - work_j + 1e-6);
  }
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
}

// The largest force is much too small, much too large, and in between; the hand is where it likes to be.
TEST_P(Grasp, C_CON_5_no_motion_of_the_hand_blows_the_body_up) {
  for (const double force_n : {0.05, 2.0, 500.0}) {
    Scene scene = block_with_forceps(GetParam());
    scene.tools[0].grip_force_n = force_n;
    Operation op(scene);
    Gripper gripper(op, 0, kAbove);
    ASSERT_NO_FATAL_FAILURE(grasp(op, gripper));
    const double energy_j = op.simulation.energy_j(), work_j = op.last.report.instrument_work_j;
    double last_work_j = work_j;
    test::Random random(3);
    const auto u = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    op.after_each = [&](const StepOutput& out) {
      ASSERT_LT(op.simulation.energy_j(), energy_j + out.report.instrument_work_j - work_j + 1e-6);
      if (op.count(EventKind::grasped) > op.count(EventKind::released)) {
        ASSERT_LE(out.report.instrument_work_j, last_work_j + force_n * 1.0 * 0.001 + 1e-9) << "the cap, at 1 m/s";
      }
      last_work_j = out.report.instrument_work_j;
      for (const Vec3f& x : op.simulation.positions_world_m(0)) ASSERT_LT(x.norm(), 0.3f);
    };
    for (int n = 0; n < 150; ++n) {
      const double far_m = n % 10 == 9 ? 0.5 : n % 3 == 0 ? 0.02 : 0.003;
      gripper.jump(far_m * Vec3(u(), u(), std::abs(u())));
      ASSERT_FALSE(HasFatalFailure()) << n;
      if (op.count(EventKind::grasped) > op.count(EventKind::released)) continue;
      gripper.jump(kAbove - gripper.tips_m());
      gripper.open();
      gripper.move(Vec3(0, 0, -0.011), 20);
      gripper.close();
    }
    op.after_each = nullptr;
    EXPECT_GT(op.count(EventKind::grasped), 5u);
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    gripper.jump(Vec3(0, 0, 0.5));
    op.rest(1500);
    const std::vector<Vec3> after = positions_of(op);
    for (std::size_t v = 0; v < after.size(); ++v) EXPECT_LT((after[v] - before[v]).norm(), 5e-4) << v;
  }
}

TEST_P(Grasp, C_CON_5_tissue_that_resists_more_than_the_cap_stays_behind_and_slips_out) {
  Scene scene = block_with_forceps(GetParam());
  scene.tools[0].grip_force_n = 0.05;
  Operation op(scene);
  Gripper gripper(op, 0, kAbove);
  grasp(op, gripper);
  op.rest(100);  // until the force of the jaws that closed is no longer felt
  double most_n = 0;
  op.after_each = [&](const StepOutput& out) {
    const bool holds = op.count(EventKind::grasped) > op.count(EventKind::released);
    if (holds) most_n = std::max(most_n, out.contacts[0].force_world_n.norm());
  };
  gripper.move(Vec3(0, 0, 0.03), 600);
  EXPECT_LE(most_n, 0.05 + 1e-9);
  EXPECT_GT(most_n, 0.045);
  EXPECT_EQ(text_of_last(op, EventKind::released), "slipped");
}

TEST_P(Grasp, C_CON_6_release_gives_the_tissue_back) {
  Operation op(block_with_forceps(GetParam()));
  Gripper gripper(op, 0, kAbove);
  grasp(op, gripper);
  gripper.move(Vec3(0.003, 0.002, 0.004), 100);
  op.rest(200);
  EXPECT_EQ(op.count(EventKind::released), 0u);
  gripper.open();
  EXPECT_EQ(op.count(EventKind::released), 1u);
  EXPECT_EQ(text_of_last(op, EventKind::released), "opened");
  gripper.move(Vec3(0, 0, 0.03), 100);
  op.rest(1500);
  EXPECT_EQ(op.force_n().norm(), 0);
  const std::vector<Vec3> after = positions_of(op);
  for (std::size_t v = 0; v < after.size(); ++v) EXPECT_LT((after[v] - before[v]).norm(), 1e-4) << v;
}

TEST_P(Grasp, C_CON_4_jaws_that_close_on_nothing_or_on_what_is_fixed_hold_nothing) {
  Operation op(block_with_forceps(GetParam()));
  Gripper gripper(op, 0, Vec3(0, 0, kBlockTop_m + 0.02));
  gripper.close();
  gripper.move(Vec3(0, 0, -0.0205), 100);  // closed already when they come
  gripper.move(Vec3(0.05, 0, 0.03), 100);
  gripper.open();
  gripper.move(Vec3(0.031, 0, -0.0065) - gripper.tips_m(), 1);
  gripper.close();
  EXPECT_EQ(op.count(EventKind::grasped), 0u);
}

TEST_P(Grasp, C_CON_3_a_ball_pushes_the_surface_out_and_holds_it) {
  Scene scene = block_with_forceps(GetParam());
  scene.tools[0] = tool_of("ball", "probe");
  scene.tools[0].geometry.sphere_radius_m = 0.008;
  Operation op(scene);
  op.rest(300);
  op.place(Vec3(0, 0, kBlockTop_m + 0.012));
  const auto deepest_m = [&] {
    double deepest = 0;
    for (const Vec3& x : positions_of(op)) deepest = std::max(deepest, 0.008 - (x - op.hand().position_m).norm());
    return deepest;
  };
  const double layer_m = 0.0005;  // tissue that the mesh does not resolve
  op.move(Vec3(0, 0, kBlockTop_m + 0.004), 0.02);
  EXPECT_LT(deepest_m(), layer_m);
  for (int n = 0; n < 300; ++n) op.step({{0, op.hand()}});
  EXPECT_LT(deepest_m(), layer_m);
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_GT(op.force_n().z(), 0.005);
  // At once, far in: pushed out within a few steps and still there.
  const double energy_j = op.simulation.energy_j();
  op.place(Vec3(0, 0, kBlockTop_m + 0.001));
  for (int n = 0; n < 100; ++n) op.step({{0, op.hand()}});
  EXPECT_LT(deepest_m(), 2 * layer_m);
  EXPECT_LT(op.simulation.energy_j(), energy_j + 0.1);
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
}

// A knife goes through the block beside what is held, and under it.
class GraspedVolume : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(C_EXP, GraspedVolume, testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(GraspedVolume, C_EXP_4_a_third_arm_holds_while_two_others_work) {
  Scene scene = block_with_forceps(GetParam());
  scene.bodies[0].cutting.style = "semi_progressive";
  scene.bodies[0].cutting.threshold_force_n = 0.02;
  scene.tools.push_back(tool_of("pulls", "forceps"));
  scene.tools[1].grip_radius_m = 0.008;
  scene.tools.push_back(tool_of("knife", "knife"));
  scene.tools[2].geometry = {Vec3(0, 0, 0.01), Vec3(0, 0, 0.09), Vec3(0.002, 0, 0.07), Vec3(0.002, 0, 0.09), 0.06};
  Operation op(scene);
  Gripper holds(op, 0, Vec3(-0.02, 0, kBlockTop_m + 0.01)), pulls(op, 1, Vec3(0.02, 0, kBlockTop_m + 0.01));
  for (Gripper* gripper : {&holds, &pulls}) {
    gripper->move(Vec3(0, 0, -0.011), 50);
    gripper->close();
  }
  ASSERT_EQ(op.count(EventKind::grasped), 2u);
  pulls.move(Vec3(0.003, 0, 0.002), 100);
  // Along y, its sharp edge (tool +x) ahead, through the upper half.
  const Eigen::Quaterniond along(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()));
  op.place(Vec3(0.0021, -0.04, 0.01), along, 2);
  op.move(Vec3(0.0021, 0.04, 0.01), 0.1, 2);
  EXPECT_GT(op.deltas, 3u);
  EXPECT_GT(op.walls(), 10u);
  EXPECT_EQ(op.count(EventKind::released), 0u);
  EXPECT_GT(op.force_n(0).norm(), 0.001);
  EXPECT_GT(op.force_n(1).norm(), 0.001);
  EXPECT_LT(op.force_n(1).x(), 0) << "the tissue pulls back";
  op.expect_valid();
}

class GraspedPart : public testing::TestWithParam<FreeParts> {};
INSTANTIATE_TEST_SUITE_P(C_CON, GraspedPart, testing::Values(FreeParts::rigid, FreeParts::deformable));

TEST_P(GraspedPart, C_CON_4_a_part_that_comes_off_is_still_held_and_lifted_out) {
  Scene scene = loop_scene(GetParam());
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.tools[1] = tool_of("forceps", "forceps");
  scene.tools[1].grip_radius_m = 0.006;
  Operation op(scene);
  Gripper gripper(op, 1, Vec3(0, 0, kOrganTop_m + 0.01));
  gripper.move(Vec3(0, 0, -0.011), 50);
  gripper.close();
  ASSERT_EQ(op.count(EventKind::grasped), 1u);
  cut_arc(op, 0, 375);
  lift(op);
  ASSERT_EQ(op.simulation.body_count(), 2u);
  EXPECT_EQ(op.count(EventKind::grasped), 2u);
  EXPECT_EQ(op.count(EventKind::released), 1u) << "of the organ";
  EXPECT_EQ(text_of_last(op, EventKind::grasped), "came off");
  const auto mean_z_m = [&] {
    double sum = 0;
    const auto x = positions_of(op, 1);
    for (const Vec3& p : x) sum += p.z();
    return sum / static_cast<double>(x.size());
  };
  const double in_bed_m = mean_z_m();
  gripper.move(Vec3(0, 0, 0.03), 1000);
  for (int n = 0; n < 200; ++n) gripper.step(0);
  EXPECT_EQ(op.count(EventKind::released), 1u);
  EXPECT_NEAR(mean_z_m(), in_bed_m + 0.03, 3e-3);
  const double mass_kg = check(op.mesh(1)).volume_m3 * scene.bodies[0].material.density_kg_per_m3;
  if (GetParam() == FreeParts::rigid) {
    EXPECT_NEAR(op.force_n(1).z(), -9.81 * mass_kg, 2e-3) << "its weight is felt";
  }
  gripper.open();
  EXPECT_EQ(op.count(EventKind::released), 2u);
}

}  // namespace
}  // namespace sectio::test
