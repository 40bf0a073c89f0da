// Paper A, 2.3: complete cuts. A part that a closed cut separates becomes a body: when that is seen, what it keeps,
// and how it answers to an instrument afterwards.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>
#include <utility>

#include "common/mesh/check.h"
#include "sim_server/body_contact/rigid_body.h"
#include "sim_server/instruments/instrument.h"
#include "tests/support/loop_cut.h"

namespace sectio::test {
namespace {

double rest_volume_m3(const Operation& op) {
  double sum = 0;
  for (std::uint32_t b = 0; b < op.simulation.body_count(); ++b) sum += check(op.mesh(b)).volume_m3;
  return sum;
}

std::vector<Vec3> positions(const Operation& op, std::uint32_t body) {
  std::vector<Vec3> result;
  for (const Vec3f& p : op.simulation.positions_world_m(body)) result.push_back(p.cast<double>());
  return result;
}

// The largest change of a distance between vertices that lie far apart.
double strain_m(const std::vector<Vec3>& before, const std::vector<Vec3>& after) {
  double most = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    const std::size_t w = (v + before.size() / 2) % before.size();
    most = std::max(most, std::abs((after[v] - after[w]).norm() - (before[v] - before[w]).norm()));
  }
  return most;
}

std::uint64_t step_of(const Operation& op, EventKind kind) {
  for (const Event& e : op.events)
    if (e.kind == kind) return e.step;
  return 0;
}

void expect_one_part(const Operation& op) {
  ASSERT_EQ(op.simulation.body_count(), 2u);
  EXPECT_EQ(op.count(EventKind::body_split), 1u);
  for (const std::uint32_t b : {0u, 1u}) {
    const SurfaceReport report = check(op.mesh(b));
    EXPECT_TRUE(report.valid()) << report.first_defect;
    EXPECT_EQ(report.components, 1u) << "body " << b;
  }
}

// Degrees: the first arc ends, the second begins beside its end, or a little before it.
struct Arcs {
  double first_end, second_begin;
};
class TwoSequences : public testing::TestWithParam<Arcs> {};
INSTANTIATE_TEST_SUITE_P(A_SEQ, TwoSequences,
                         testing::Values(Arcs{130, 138}, Arcs{200, 208}, Arcs{250, 246}, Arcs{250, 258}, Arcs{290, 292},
                                         Arcs{290, 295}));

TEST_P(TwoSequences, A_SEQ_4_with_other_starts_and_other_actions_between_split_when_they_close) {
  Operation op(loop_scene(FreeParts::rigid));
  cut_arc(op, 0, GetParam().first_end);
  lift(op);
  EXPECT_EQ(op.simulation.body_count(), 1u);
  // Meanwhile the other instrument presses elsewhere, and the organ rests.
  op.place({-0.03, 0, organ_height_m(-0.03, 0) + 0.002}, Eigen::Quaterniond::Identity(), 1);
  op.tip_to(-0.03, 0, 0.0002, 0.01, 1);
  op.tip_to(-0.03, 0, -0.01, 0.02, 1);
  op.rest(200);
  op.after_each = [&](const StepOutput& out) {
    EXPECT_EQ(out.new_bodies.empty(),
              std::ranges::none_of(out.events, [](const Event& e) { return e.kind == EventKind::body_split; }));
  };
  cut_arc(op, GetParam().second_begin, 370);
  lift(op);
  expect_one_part(op);
  EXPECT_EQ(step_of(op, EventKind::body_split), step_of(op, EventKind::island_freed)) << "in the step that closed it";
}

TEST(A_SEQ, A_SEQ_5_one_sequence_interrupted_by_a_rest_splits_when_it_closes) {
  Operation op(loop_scene(FreeParts::rigid));
  cut_arc(op, 0, 150);
  op.rest(300);
  EXPECT_EQ(op.simulation.body_count(), 1u);
  cut_on(op, 150, 375);
  lift(op);
  expect_one_part(op);
}

TEST(A_SEQ, A_SEQ_6_parts_have_ids_and_sum_to_the_whole_and_the_anchored_one_deforms) {
  Operation op(loop_scene(FreeParts::rigid));
  op.after_each = [&](const StepOutput& out) {
    if (out.new_bodies.empty()) return;
    // The cut's own delta and the one that gives the part up, both of this step, both of the parent.
    ASSERT_EQ(out.new_bodies.size(), 1u);
    EXPECT_EQ(out.new_bodies[0].body_id, 1u);
    EXPECT_EQ(out.new_bodies[0].parent_id, 0u);
    ASSERT_EQ(out.deltas.size(), 2u);
    for (const BodyDelta& d : out.deltas) EXPECT_EQ(d.body_id, 0u);
    EXPECT_EQ(out.deltas[1].delta.revision, op.mesh(0).revision());
    EXPECT_EQ(op.mesh(1).revision(), 0u);
    EXPECT_TRUE(out.publish_now);
  };
  cut_arc(op, 0, 375);
  op.after_each = nullptr;
  lift(op);
  expect_one_part(op);
  EXPECT_NE(op.simulation.body(0).name, op.simulation.body(1).name);

  const RigidBody* piece = op.simulation.rigid_body(1);
  ASSERT_NE(piece, nullptr);
  EXPECT_EQ(op.simulation.rigid_body(0), nullptr);
  const double density = op.scene.bodies[0].material.density_kg_per_m3, volume = check(op.mesh(1)).volume_m3;
  EXPECT_GT(volume, 1e-7);
  EXPECT_NEAR(piece->mass_kg(), density * volume, 1e-9 * piece->mass_kg());

  // Press on the rest of the organ: it gives way there and nowhere else.
  const std::vector<Vec3> before = positions(op, 0);
  op.place({-0.03, 0, organ_height_m(-0.03, 0) + 0.002}, Eigen::Quaterniond::Identity(), 1);
  op.tip_to(-0.03, 0, 0.0005, 0.01, 1);
  EXPECT_GT(strain_m(before, positions(op, 0)), 1e-4);
}

TEST(A_SEQ, A_SEQ_6_volume_is_kept_to_the_last_digits_by_the_split) {
  // The closing step cuts as well, which takes the volume of its grooves; so the same stroke is made on two organs, one
  // that splits and one that keeps its parts.
  Operation kept(loop_scene(FreeParts::keep)), split(loop_scene(FreeParts::rigid));
  for (Operation* op : {&kept, &split}) cut_arc(*op, 0, 375);
  EXPECT_EQ(kept.simulation.body_count(), 1u);
  EXPECT_EQ(split.simulation.body_count(), 2u);
  EXPECT_NEAR(rest_volume_m3(split), rest_volume_m3(kept), 1e-9 * rest_volume_m3(kept));
}

TEST(A_SEQ, A_SEQ_6_a_fragment_below_the_stated_size_is_removed_with_an_event_and_its_volume_is_counted) {
  Scene scene = loop_scene(FreeParts::rigid);
  scene.bodies[0].splitting.least_volume_m3 = 1e-5;
  Operation kept(loop_scene(FreeParts::keep)), removed(scene);
  for (Operation* op : {&kept, &removed}) cut_arc(*op, 0, 375);
  EXPECT_EQ(removed.simulation.body_count(), 1u);
  EXPECT_EQ(removed.count(EventKind::body_split), 0u);
  ASSERT_EQ(removed.count(EventKind::fragment_removed), 1u);
  EXPECT_EQ(step_of(removed, EventKind::fragment_removed), step_of(removed, EventKind::island_freed));
  EXPECT_EQ(check(removed.mesh()).components, 1u);
  const double gone_m3 = removed.last.report.removed_volume_m3;
  EXPECT_GT(gone_m3, 1e-7);
  EXPECT_NEAR(rest_volume_m3(removed) + gone_m3, rest_volume_m3(kept), 1e-9 * rest_volume_m3(kept));
  lift(removed);  // and the instrument goes on as if nothing were
  removed.expect_valid();
}

// The state of a body at one step, by rest position: what stays when slots are numbered anew.
using Places = std::map<std::array<double, 3>, Vec3>;
Places places(const Operation& op, std::uint32_t body) {
  Places result;
  std::set<std::array<double, 3>> twins;
  const TriangleMesh& mesh = op.mesh(body);
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    const Vec3& x = mesh.rest_body_m(v);
    if (!mesh.vertex_alive(v)) continue;
    const std::array<double, 3> rest{x.x(), x.y(), x.z()};
    if (!result.emplace(rest, op.simulation.positions_world_m(body)[v].cast<double>()).second) twins.insert(rest);
  }
  for (const auto& rest : twins) result.erase(rest);  // the lips of a cut begin at one place
  return result;
}

// Mean motion of what all three have in common, from the first to the second.
Vec3 mean_motion(const Places& from, const Places& to, const Places& of) {
  Vec3 sum = Vec3::Zero();
  int n = 0;
  for (const auto& [rest, at] : of) {
    const auto a = from.find(rest), b = to.find(rest);
    if (a == from.end() || b == to.end()) continue;
    sum += b->second - a->second;
    ++n;
  }
  EXPECT_GT(n, 20);
  return sum / n;
}

TEST(A_SEQ, A_SEQ_7_the_free_part_answers_with_rigid_motion_and_momentum_is_continuous) {
  Scene scene = loop_scene(FreeParts::rigid);
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  Operation op(scene);
  Places before_last, last;  // places of the organ
  double jump_m_per_s = -1;
  op.after_each = [&](const StepOutput& out) {
    if (!out.new_bodies.empty()) {
      const Places piece = places(op, 1);
      const RigidBody& rigid = *op.simulation.rigid_body(1);
      Vec3 before = mean_motion(before_last, last, piece) / op.scene.step_s, after = Vec3::Zero();
      int n = 0;
      for (const auto& [rest, at] : piece)
        if (last.contains(rest) && before_last.contains(rest)) after += rigid.velocity_at(at), ++n;
      jump_m_per_s = (after / n - before).norm();
    }
    if (op.simulation.body_count() > 1) return;
    before_last = std::exchange(last, places(op, 0));
  };
  cut_arc(op, 0, 375);
  lift(op);
  ASSERT_EQ(op.simulation.body_count(), 2u);
  EXPECT_GE(jump_m_per_s, 0);
  EXPECT_LT(jump_m_per_s, 0.03) << "a step of gravity is 0.01";
  for (int i = 0; i < 3000 && !op.simulation.rigid_body(1)->asleep(); ++i) op.rest(1);
  EXPECT_LT(op.simulation.rigid_body(1)->velocity_m_per_s().norm(), 0.02) << "it stays in its bed";

  // Push the piece at its edge, which tilts it; its shape stays.
  const std::vector<Vec3> before = positions(op, 1);
  double top = -1;
  for (const Vec3& x : before)
    if (std::hypot(x.x() - 0.006, x.y()) < 0.004) top = std::max(top, x.z());
  op.place({0.006, 0, top + 0.004}, Eigen::Quaterniond::Identity(), 1);
  op.move({0.006, 0, top - 0.002}, 0.02, 1);
  const std::vector<Vec3> after = positions(op, 1);
  double moved = 0;
  for (std::size_t v = 0; v < before.size(); ++v) moved = std::max(moved, (after[v] - before[v]).norm());
  EXPECT_GT(moved, 2e-4);
  EXPECT_LT(strain_m(before, after), 1e-6) << "rigid";
  EXPECT_GT(op.count(EventKind::contact_began), 0u);
}

TEST(A_SEQ, A_SEQ_7_forceps_lift_the_free_part_out_and_it_falls_when_they_open) {
  Scene scene = loop_scene(FreeParts::rigid);
  scene.gravity_m_per_s2 = Vec3(0, 0, -9.81);
  scene.floor_z_m = -0.03;
  scene.tools[1].kind = "forceps";
  scene.tools[1].geometry = instrument_of("forceps").geometry;
  Operation op(scene);
  cut_arc(op, 0, 375);
  lift(op);
  lift(op);  // above the way of the piece
  ASSERT_EQ(op.simulation.body_count(), 2u);
  Pose tips{Vec3(0, 0, kOrganTop_m + 0.01), Eigen::Quaterniond::Identity()};
  const auto go = [&](const Vec3& by_m, double from_rad, double to_rad, int steps) {
    for (int i = 1; i <= steps; ++i) {
      tips.position_m += by_m / steps;
      StepInput input;
      input.samples.push_back(op.sample(1, tips));
      input.samples[0].opening_rad = from_rad + (to_rad - from_rad) * i / steps;
      op.step(input);
    }
  };
  go(Vec3(0, 0, -0.012), 0.3, 0.3, 300);
  go(Vec3::Zero(), 0.3, 0, 200);
  EXPECT_EQ(op.count(EventKind::grasped), 1u);
  const RigidBody& piece = *op.simulation.rigid_body(1);
  const double in_bed_m = piece.pose_world().position_m.z();
  go(Vec3(0, 0, 0.03), 0, 0, 600);
  EXPECT_NEAR(piece.pose_world().position_m.z(), in_bed_m + 0.03, 1e-3);
  EXPECT_NEAR(op.force_n(1).z(), -9.81 * piece.mass_kg(), 2e-3) << "its weight is felt";
  go(Vec3(0.1, 0, 0), 0, 0, 600);
  EXPECT_EQ(op.count(EventKind::released), 0u);
  go(Vec3::Zero(), 0, 0.3, 100);
  EXPECT_EQ(op.count(EventKind::released), 1u);
  for (int i = 0; i < 1500 && !piece.asleep(); ++i) op.rest(1);
  EXPECT_TRUE(piece.asleep());
  EXPECT_LT(piece.pose_world().position_m.z(), -0.02) << "on the floor";
  EXPECT_NEAR(piece.pose_world().position_m.x(), 0.1, 0.02);
}

TEST(A_SEQ, A_SEQ_7_by_policy_the_free_part_stays_deformable) {
  Operation op(loop_scene(FreeParts::deformable));
  cut_arc(op, 0, 375);
  lift(op);
  expect_one_part(op);
  EXPECT_EQ(op.simulation.rigid_body(1), nullptr);
  op.rest(300);
  const std::vector<Vec3> before = positions(op, 1);
  op.place({0, 0, kOrganTop_m + 0.004}, Eigen::Quaterniond::Identity(), 1);
  op.move({0, 0, kOrganTop_m - 0.001}, 0.02, 1);
  EXPECT_GT(strain_m(before, positions(op, 1)), 1e-5);
}

}  // namespace
}  // namespace sectio::test
