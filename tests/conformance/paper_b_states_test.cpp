// Paper B, sections 2 and 3, in the whole simulation: contact, penetration and termination; the decision tree; the
// threshold; cautery.
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

// With the tip above a point of the organ, then in it.
void come_down(Operation& op, double x_m, double y_m, double depth_m) {
  op.place({x_m, y_m, organ_height_m(x_m, y_m) + 0.004});
  op.tip_to(x_m, y_m, depth_m);
}

// Counts changes of triangles from here on: there should be none.
struct TopologyWatch {
  explicit TopologyWatch(Operation& o) : op(o), triangles(o.mesh().triangle_count()) {
    op.after_each = [this](const StepOutput& out) {
      for (const BodyDelta& d : out.deltas) edits += d.delta.triangles.size();
    };
  }
  ~TopologyWatch() {
    op.after_each = nullptr;
    EXPECT_EQ(edits, 0u);
    EXPECT_EQ(op.mesh().triangle_count(), triangles);
  }
  Operation& op;
  std::size_t triangles, edits = 0;
};

// A scalpel in the organ, cutting towards +x along y = 1 mm.
struct InTissue {
  explicit InTissue(const Scene& scene = organ_scene()) : op(scene) {
    come_down(op, -0.02, 0.001, kStrokeDepth_m);
    op.tip_to(-0.01, 0.001, kStrokeDepth_m);
    EXPECT_EQ(op.state(), ContactState::penetration);
    EXPECT_GT(op.walls(), 8u);
  }
  Operation op;
};

TEST(B_STATE, B_STATE_1_below_the_threshold_the_surface_only_deforms) {
  Scene scene = organ_scene();
  scene.bodies[0].cutting.threshold_force_n = 50;
  Operation op(scene);
  const TriangleMesh before = op.mesh();
  come_down(op, 0, 0.001, 0.004);
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_GT(op.force_n().z(), 0.1) << "felt";
  op.tip_to(0.01, 0.001, 0.004);  // and sliding
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_EQ(op.deltas, 0u);
  EXPECT_TRUE(op.mesh().same_database(before));
  EXPECT_EQ(op.count(EventKind::contact_began), 1u);
  float lowest = 1;
  for (VertexId v = 0; v < op.mesh().vertex_slots(); ++v) {
    const Vec3f x = op.simulation.positions_world_m(0)[v];
    if (std::hypot(x.x() - 0.01f, x.y()) < 0.008f && x.z() > 0) lowest = std::min(lowest, x.z());
  }
  EXPECT_LT(lowest, kOrganTop_m - 0.002) << "dented";
  op.tip_to(0.01, 0.001, -0.01);
  EXPECT_EQ(op.state(), ContactState::free);
  EXPECT_EQ(op.count(EventKind::contact_ended), 1u);
  EXPECT_EQ(op.force_n().norm(), 0);
}

TEST(B_STATE, B_STATE_2_above_the_threshold_it_penetrates_and_may_cut) {
  Operation op(organ_scene());
  double pushed_n = 0;
  op.after_each = [&](const StepOutput& out) {
    if (out.contacts[0].state == ContactState::contact)
      pushed_n = std::max(pushed_n, out.contacts[0].force_world_n.norm());
    EXPECT_TRUE(out.deltas.empty() || out.contacts[0].state == ContactState::penetration);
  };
  come_down(op, -0.02, 0.001, kStrokeDepth_m);
  EXPECT_EQ(op.state(), ContactState::penetration);
  EXPECT_EQ(op.count(EventKind::penetrated), 1u);
  EXPECT_NEAR(pushed_n, 0.1, 0.03) << "it gave way at its threshold";
  op.tip_to(-0.01, 0.001, kStrokeDepth_m);
  EXPECT_GT(op.walls(), 8u);
  op.expect_valid();
}

TEST(B_STATE, B_STATE_3_lifting_ends_the_cut_and_its_last_point_stays) {
  InTissue in;
  Operation& op = in.op;
  op.tip_to(-0.008, 0.001, -0.008);
  EXPECT_EQ(op.state(), ContactState::free);
  EXPECT_EQ(op.count(EventKind::cut_ended), 1u);
  const TriangleMesh after = op.mesh();
  op.tip_to(0.02, 0.02, -0.01);
  op.rest(100);
  EXPECT_TRUE(op.mesh().same_database(after));
  op.expect_valid();
  EXPECT_EQ(check(after).euler_characteristic, 2);
}

TEST(B_CD, B_CD_2_forward_it_cuts) {
  InTissue in;
  const std::size_t walls = in.op.walls();
  in.op.tip_to(0.015, 0.001, kStrokeDepth_m);
  EXPECT_GT(in.op.walls(), walls + 8);
  EXPECT_LT(in.op.force_n().x(), -0.2) << "the work of cutting is felt";
  EXPECT_EQ(in.op.last.report.cuts_refused, 0u);
}

TEST(B_CD, B_CD_3_backward_it_pushes_back_and_does_not_cut) {
  InTissue in;
  Operation& op = in.op;
  const TopologyWatch watch(op);
  op.tip_to(-0.015, 0.001, kStrokeDepth_m);
  EXPECT_GT(op.force_n().x(), 0.05) << "against the motion";
  EXPECT_EQ(op.state(), ContactState::penetration);
}

TEST(B_CD, B_CD_9_sideways_it_is_held) {
  for (const double side : {-1.0, 1.0}) {
    InTissue in;
    Operation& op = in.op;
    const TopologyWatch watch(op);
    op.tip_to(-0.01, 0.001 + side * 0.003, kStrokeDepth_m);
    EXPECT_LT(side * op.force_n().y(), -0.05) << "against the motion";
    EXPECT_LT(std::abs(op.force_n().x()), std::abs(op.force_n().y()));
  }
}

TEST(B_CD, B_CD_4_ac_inside_as_a_whole_is_pushed_out_along_the_normal) {
  Scene scene = organ_scene();
  scene.tools[0].geometry.c_tool_m = Vec3(0.001, 0, 0.012);  // a steep edge, so that sinking is not cutting forward
  scene.tools[0].geometry.d_tool_m = Vec3(0.001, 0, 0.014);
  InTissue in(scene);
  Operation& op = in.op;
  op.tip_to(-0.01, 0.001, 0.010);  // deeper, the heel still outside
  const TopologyWatch watch(op);
  op.tip_to(-0.01, 0.001, 0.018);
  EXPECT_EQ(op.state(), ContactState::penetration);
  EXPECT_GT(op.force_n().z(), 0.2) << "out of the surface";
  EXPECT_GT(op.force_n().z(), 3 * op.force_n().head<2>().norm());
}

TEST(B_CD, B_CD_5_the_shaft_deforms_but_does_not_cut) {
  InTissue in;
  Operation& op = in.op;
  op.tip_to(-0.01, 0.001, 0.010);
  op.tip_to(-0.01, 0.001, 0.016, 0.2);  // C is inside, D is not
  const TopologyWatch watch(op);
  op.tip_to(-0.006, 0.001, 0.016);
  EXPECT_LT(op.force_n().x(), -0.05) << "forward, and yet held";
}

TEST(B_CD, B_CD_6_free_of_the_surface_it_looks_again) {
  InTissue in;
  Operation& op = in.op;
  op.tip_to(-0.01, 0.001, -0.006);
  EXPECT_EQ(op.state(), ContactState::free);
  const auto searches = op.last.report.local_searches + op.last.report.global_searches;
  op.tip_to(0.002, 0.001, -0.006);
  op.tip_to(0.002, 0.001, kStrokeDepth_m);
  EXPECT_GT(op.last.report.local_searches + op.last.report.global_searches, searches);
  EXPECT_GE(op.count(EventKind::contact_began), 2u) << "and finds the surface";
  EXPECT_EQ(op.count(EventKind::penetrated), 2u);
}

TEST(B_CD, B_CD_7_the_side_of_the_shaft_deforms_and_is_felt) {
  Operation op(organ_scene());
  // The shaft lies across the top and comes down.
  const Eigen::Quaterniond lying(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()));
  op.place({0, 0.015, kOrganTop_m + 0.003}, lying);
  op.move({0, 0.015, kOrganTop_m - 0.003});
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_GT(op.force_n().z(), 0.05);
  EXPECT_EQ(op.deltas, 0u) << "AB never cuts";
}

TEST(B_CD, B_CD_8_a_displacement_threshold) {
  Scene scene = organ_scene();
  scene.bodies[0].cutting.threshold_force_n.reset();
  scene.bodies[0].cutting.threshold_displacement_m = 0.003;
  Operation op(scene);
  double deepest_dent_m = 0;
  op.after_each = [&](const StepOutput& out) {
    if (out.contacts[0].state == ContactState::contact)
      deepest_dent_m = std::max(deepest_dent_m, kOrganTop_m - op.hand().position_m.z());
  };
  come_down(op, 0, 0, 0.0025);
  EXPECT_EQ(op.state(), ContactState::contact);
  op.tip_to(0, 0, 0.005);
  EXPECT_EQ(op.state(), ContactState::penetration);
  EXPECT_NEAR(deepest_dent_m, 0.003, 2e-4);
}

TEST(B_CD, B_CD_8_hysteresis_after_a_cut) {
  Scene scene = organ_scene();
  scene.bodies[0].cutting.threshold_force_n.reset();
  scene.bodies[0].cutting.threshold_displacement_m = 0.003;
  const double between_m = 0.0026;  // more than 0.7 x 3 mm, less than 3 mm
  {
    Operation fresh(scene);
    come_down(fresh, 0.01, 0.001, between_m);
    fresh.rest(20);
    EXPECT_EQ(fresh.state(), ContactState::contact);
  }
  Operation op(scene);
  come_down(op, -0.02, 0.001, 0.005);
  op.tip_to(-0.012, 0.001, 0.005);
  op.tip_to(-0.010, 0.001, -0.004);
  op.tip_to(0.01, 0.001, -0.004);
  ASSERT_EQ(op.state(), ContactState::free);
  op.tip_to(0.01, 0.001, between_m);
  op.rest(20);
  EXPECT_EQ(op.state(), ContactState::penetration) << "an instrument that has just been cutting needs less";
}

// Cautery.

Scene cautery_scene(double intensity) {
  Scene scene = organ_scene();
  scene.tools[0].kind = "cautery_hook";
  scene.tools[0].geometry = instrument_of("cautery_hook").geometry;
  scene.tools[0].intensity = intensity;
  return scene;
}

// The depth of the groove at rest.
double deepest_groove_m(const TriangleMesh& mesh) {
  double deepest = 0;
  for (const Triangle& t : mesh.triangles())
    if (t.alive() && t.surface == Surface::wall)
      for (const VertexId v : t.v) {
        const Vec3& x = mesh.rest_body_m(v);
        deepest = std::max(deepest, organ_height_m(x.x(), x.y()) - x.z());
      }
  return deepest;
}

TEST(B_CD, B_CD_10_the_virtual_tip_cuts_where_the_probe_does_not_touch) {
  Operation op(cautery_scene(1));
  const Vec3 start(-0.015, 0.001, organ_height_m(-0.015, 0.001) + 0.0015);  // the probe's end stays above
  op.place(start + Vec3(0, 0, 0.01));
  op.move(start);
  EXPECT_EQ(op.state(), ContactState::penetration);
  op.move(Vec3(0.015, 0.001, kOrganTop_m + 0.0015));
  EXPECT_GT(op.walls(), 20u);
  op.move(Vec3(0.010, -0.006, kOrganTop_m + 0.0015));  // in any direction
  op.expect_valid();
  EXPECT_EQ(op.last.report.cuts_refused, 0u);
}

TEST(B_CD, B_CD_10_the_groove_is_as_deep_as_the_intensity_says) {
  std::vector<double> depth;
  for (const double intensity : {0.6, 1.0, 1.4}) {
    Operation op(cautery_scene(intensity));
    const double above_m = 0.001;
    op.place({-0.01, 0.001, organ_height_m(-0.01, 0.001) + 0.01});
    op.tip_to(-0.01, 0.001, -above_m);
    op.tip_to(0.01, 0.001, -above_m);
    op.tip_to(0.01, 0.001, -0.015);
    depth.push_back(deepest_groove_m(op.mesh()));
    EXPECT_NEAR(depth.back(), intensity * 0.005 - above_m, 8e-4) << intensity;
  }
  EXPECT_NEAR(depth[2] - depth[1], depth[1] - depth[0], 3e-4) << "proportional";
}

TEST(B_CD, B_CD_10_without_current_the_probe_only_deforms) {
  Operation op(cautery_scene(0));
  op.place({0, 0.001, kOrganTop_m + 0.005});
  op.tip_to(0, 0.001, 0.003);
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_GT(op.force_n().z(), 0.1) << "felt";
  op.tip_to(0.008, 0.001, 0.003);
  EXPECT_EQ(op.deltas, 0u);
}

}  // namespace
}  // namespace sectio::test
