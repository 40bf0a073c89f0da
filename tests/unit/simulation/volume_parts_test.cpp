// Volumes that are cut through in the whole simulation: what hangs turns under the blade and comes off whole.
#include <gtest/gtest.h>

#include "common/delta/keyframe.h"
#include "common/math/trace.h"
#include "common/mesh/check.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/instruments/instrument.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/scene/scene.h"
#include "sim_server/session/run_outcome.h"
#include "sim_server/simulation.h"
#include "sim_server/volume/volume_cutting.h"
#include "sim_server/volume/volume_engines.h"
#include "sim_server/world/body.h"
#include "tests/support/operation.h"
#include "tests/support/shapes.h"

namespace sectio::simulation_test {
namespace {

using test::Operation;

// 20 x 20 x 80 mm, held at its upper end.
Scene hanging_bar(const std::string& model, const std::string& style, FreeParts free_parts, std::size_t knives = 1) {
  Scene scene;
  scene.file = "bar";
  BodySpec bar;
  bar.name = "bar";
  bar.model = model;
  bar.mesh = test::box(3, 3, 12, Vec3(0.02, 0.02, 0.08));
  bar.pose.position_m = Vec3(-0.01, -0.01, -0.08);
  bar.material.young_pa = 10000;
  bar.material.poisson = 0.4;
  bar.volume.tetrahedra = 1000;
  bar.volume.least_part_s = 1e-4;
  bar.cutting.style = style;
  bar.cutting.threshold_force_n = 0.005;
  bar.splitting.free_parts = free_parts;
  bar.fixed = Box{Vec3(-1, -1, -0.008), Vec3(1, 1, 1)};
  scene.bodies.push_back(bar);
  scene.floor_z_m = -0.12;
  for (std::size_t n = 0; n < knives; ++n) {
    ToolSpec knife;
    knife.name = "knife" + std::to_string(n);
    knife.kind = "knife";
    knife.geometry.b_tool_m = Vec3(0, 0, 0.06);
    knife.geometry.c_tool_m = Vec3(0.002, 0, 0.05);
    knife.geometry.d_tool_m = Vec3(0.002, 0, 0.06);
    knife.geometry.sharp_length_m = 0.045;
    scene.tools.push_back(knife);
  }
  return scene;
}

// Its edge along x, its sharp side to +y.
Pose flat(double y_m, double z_m) {
  Mat3 m;
  m << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return {Vec3(-0.02, y_m, z_m), Eigen::Quaterniond(m)};
}

void cut_through(Operation& op, double z_m, const std::function<void()>& look = {}) {
  op.place(flat(-0.015, z_m).position_m, flat(0, 0).orientation);
  op.rest(100);
  for (double y_m = -0.015; y_m < 0.025; y_m += 4e-5) {
    op.step({{0, flat(y_m, z_m)}});
    if (look) look();
  }
}

double volume_m3(const Operation& op) {
  double sum = 0;
  for (std::uint32_t b = 0; b < op.simulation.body_count(); ++b) sum += check(op.mesh(b)).volume_m3;
  return sum;
}

struct Case {
  std::string model, style;
  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.model << ", " << c.style; }
};
class HangingBar : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(All, HangingBar,
                         testing::Values(Case{"neo_hookean", "semi_progressive"}, Case{"neo_hookean", "progressive"},
                                         Case{"tetra_springs", "progressive"},
                                         Case{"neo_hookean_lattice", "progressive"}),
                         [](const auto& p) { return p.param.model + "_" + p.param.style; });

TEST_P(HangingBar, C_CUT_8_cut_through_at_any_height_it_is_two_bodies_and_no_more) {
  for (const double z_m : {-0.02, -0.035, -0.05, -0.06}) {
    Operation op(hanging_bar(GetParam().model, GetParam().style, FreeParts::deformable));
    const double whole_m3 = volume_m3(op);
    cut_through(op, z_m);
    ASSERT_EQ(op.simulation.body_count(), 2u) << z_m;
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    EXPECT_NEAR(volume_m3(op) + op.last.report.removed_volume_m3, whole_m3, 1e-5 * whole_m3) << "tidied since";
    EXPECT_LT(op.last.report.removed_volume_m3, 5e-4 * whole_m3);  // crumbs: a fraction of an element
    for (std::uint32_t b = 0; b < 2; ++b) EXPECT_EQ(check(op.mesh(b)).components, 1u);
    EXPECT_NEAR(check(op.mesh(0)).volume_m3 / whole_m3, -z_m / 0.08, 0.1);
  }
}

// An edge that is deep in tissue has broken in, whatever its force was, also after a part has come off.
TEST_P(HangingBar, C_CUT_8_each_of_several_strokes_takes_a_part_off) {
  Scene scene = hanging_bar(GetParam().model, GetParam().style, FreeParts::deformable);
  scene.bodies[0].material.young_pa = 40000;
  scene.bodies[0].cutting.threshold_force_n = 0.05;
  Operation op(scene);
  std::size_t bodies = 1;
  for (const double z_m : {-0.065, -0.045, -0.025}) {
    cut_through(op, z_m);
    EXPECT_EQ(op.simulation.body_count(), ++bodies) << z_m;
    EXPECT_NEAR(check(op.mesh(0)).volume_m3 / (0.02 * 0.02 * 0.08), -z_m / 0.08, 0.1);
  }
}

// The probe burns as well as its virtual tip: one that is held beneath the skin leaves no bridge of skin over a cavity.
TEST(Hook, opens_the_skin_of_a_volume_however_deep_it_is_held) {
  for (const double depth_m : {-0.0005, 0.0005, 0.002, 0.006}) {
    Scene scene = hanging_bar("neo_hookean", "progressive", FreeParts::keep);
    BodySpec& pad = scene.bodies[0];
    pad.mesh = test::box(10, 4, 3, Vec3(0.08, 0.03, 0.02));
    pad.pose.position_m = Vec3(-0.04, -0.015, -0.02);
    pad.volume.tetrahedra = 2500;
    pad.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -0.012)};
    scene.tools[0].kind = "cautery_hook";
    scene.tools[0].geometry = instrument_of("cautery_hook").geometry;
    Operation op(scene);
    op.place({-0.02, 0.001, 0.015});
    for (double z_m = 0.015; z_m > -depth_m; z_m -= 1e-4) op.step({{0, {Vec3(-0.02, 0.001, z_m), {1, 0, 0, 0}}}});
    for (double x_m = -0.02; x_m < 0.02; x_m += 4e-5) op.step({{0, {Vec3(x_m, 0.001, -depth_m), {1, 0, 0, 0}}}});
    for (double z_m = -depth_m; z_m < 0.02; z_m += 1e-4) op.step({{0, {Vec3(0.02, 0.001, z_m), {1, 0, 0, 0}}}});
    EXPECT_EQ(check(op.mesh()).components, 1u) << depth_m << ": a cavity";
    EXPECT_GT(RunOutcome(op.simulation).finish({}).cut_m, 0.034) << depth_m;
  }
}

// The blade comes out halfway. The tidying after it reaches replicas as cuts do, and a session that is played again has
// it.
TEST(VolumeParts, C_LIM_1_short_edges_that_collapse_after_a_cut_are_deltas_that_replicas_and_replay_follow) {
  std::uint64_t first_hash = 0;
  for (int run = 0; run < 2; ++run) {
    Scene scene = hanging_bar("neo_hookean", "semi_progressive", FreeParts::deformable);
    scene.bodies[0].volume.collapse_ratio = 0.3;
    Operation op(scene);
    TriangleMesh replica = *mesh_of(keyframe_of(op.mesh()));
    std::size_t deltas = 0;
    op.after_each = [&](const StepOutput& out) {
      for (const BodyDelta& d : out.deltas) {
        ASSERT_EQ(d.body_id, 0u);
        ASSERT_EQ(apply(d.delta, replica), ApplyStatus::applied);
        ++deltas;
      }
      ASSERT_EQ(replica.hash(), op.mesh().hash());
    };
    op.place(flat(-0.015, -0.04).position_m, flat(0, 0).orientation);
    op.rest(100);
    for (double y_m = -0.015; y_m < 0.002; y_m += 4e-5) op.step({{0, flat(y_m, -0.04)}});
    for (double y_m = 0.002; y_m > -0.03; y_m -= 4e-4) op.step({{0, flat(y_m, -0.04)}});
    op.rest(1000);
    EXPECT_GT(deltas, op.last.report.cuts_made + 1) << "nothing was tidied";
    op.expect_valid();
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    if (run == 0) first_hash = op.mesh().hash();
    EXPECT_EQ(op.mesh().hash(), first_hash);
  }
}

// Both policies: a volume of its own, or a surface that moves as a whole; and replicas are told of it.
TEST(VolumeParts, fall_to_the_floor_soft_or_rigid_and_replicas_have_them) {
  for (const FreeParts policy : {FreeParts::deformable, FreeParts::rigid}) {
    Operation op(hanging_bar("neo_hookean", "progressive", policy));
    std::vector<TriangleMesh> replicas;
    replicas.push_back(*mesh_of(keyframe_of(op.mesh())));
    op.after_each = [&](const StepOutput& out) {
      for (const BodyDelta& d : out.deltas)
        if (d.body_id < replicas.size()) {
          ASSERT_EQ(apply(d.delta, replicas[d.body_id]), ApplyStatus::applied);
        }
      for (std::size_t b = replicas.size(); b < op.simulation.body_count(); ++b)
        replicas.push_back(*mesh_of(keyframe_of(op.mesh(static_cast<std::uint32_t>(b)))));
    };
    cut_through(op, -0.04);
    op.rest(600);
    ASSERT_EQ(op.simulation.body_count(), 2u);
    EXPECT_EQ(op.simulation.rigid_body(1) != nullptr, policy == FreeParts::rigid);
    float lowest = 0, highest = -1;
    for (VertexId v = 0; v < op.mesh(1).vertex_slots(); ++v) {
      if (!op.mesh(1).vertex_alive(v)) continue;
      const float z = op.simulation.positions_world_m(1)[v].z();
      lowest = std::min(lowest, z);
      highest = std::max(highest, z);
    }
    EXPECT_NEAR(lowest, -0.12, 2e-3);
    EXPECT_LT(highest, -0.06);
    for (std::uint32_t b = 0; b < 2; ++b) EXPECT_TRUE(replicas[b].same_database(op.mesh(b))) << b;
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
  }
}

// A part can be cut again, and is then three bodies with the rest.
TEST(VolumeParts, can_be_cut_again) {
  Operation op(hanging_bar("neo_hookean", "progressive", FreeParts::deformable));
  cut_through(op, -0.03);
  op.move(flat(0.05, -0.03).position_m, 1);
  op.rest(700);
  ASSERT_EQ(op.simulation.body_count(), 2u);
  cut_through(op, -0.015);  // the rest
  EXPECT_EQ(op.simulation.body_count(), 3u);
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
}

// Tissue between the blades is divided wherever their bisector meets it: the lower blade came from beneath it.
TEST(VolumeParts, scissors_divide_a_vessel_between_their_blades) {
  const Vec3 forward = Vec3(0.9659, 0, -0.2588).normalized(), down = Vec3(-0.2588, 0, -0.9659).normalized();
  Mat3 in_tool, in_world;  // the blades close in a level plane
  in_tool << forward, down, forward.cross(down);
  in_world << Vec3::UnitX(), -Vec3::UnitY(), -Vec3::UnitZ();
  for (const std::string model : {"neo_hookean", "neo_hookean_lattice", "tetra_springs"})
    for (const double aside_m : {-0.002, 0.0, 0.0025}) {
      Scene scene = hanging_bar(model, "progressive", FreeParts::deformable);
      BodySpec& vessel = scene.bodies[0];
      vessel.mesh = test::box(3, 3, 24, Vec3(0.006, 0.006, 0.05));
      vessel.pose.position_m = Vec3(-0.003, -0.003, -0.05);
      vessel.volume.cell_m = 0.002;
      scene.tools[0] = {};
      scene.tools[0].name = "scissors";
      scene.tools[0].kind = "scissors";
      scene.tools[0].geometry = instrument_of("scissors").geometry;
      Operation op(scene);
      const Pose at{Vec3(0.012, aside_m, -0.03), Eigen::Quaterniond(in_world * in_tool.transpose())};
      for (double opening_rad = 0.7; opening_rad > 0; opening_rad -= 0.001) {
        ToolSample sample = op.sample(0, at);
        sample.opening_rad = opening_rad;
        StepInput input;
        input.samples = {sample};
        op.step(input);
      }
      EXPECT_EQ(op.simulation.body_count(), 2u) << model << ", " << aside_m << " m aside";
      EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    }
}

// In a body that is thinner than an edge is deep in others once it has broken in.
TEST(VolumeParts, a_blade_goes_through_a_small_body_with_any_force) {
  Scene scene = hanging_bar("neo_hookean", "progressive", FreeParts::deformable);
  BodySpec& bar = scene.bodies[0];
  bar.mesh = test::box(3, 3, 12, Vec3(0.00125, 0.00125, 0.005));
  bar.pose.position_m = Vec3(-0.000625, -0.000625, -0.005);
  bar.fixed = Box{Vec3(-1, -1, -0.001), Vec3(1, 1, 1)};
  bar.volume.least_part_s = 1e-5;
  bar.cutting.threshold_force_n = 0.1;
  Operation op(scene);
  for (double y_m = -0.0015; y_m < 0.0015; y_m += 4e-6) op.step({{0, flat(y_m, -0.0025)}});
  EXPECT_EQ(op.simulation.body_count(), 2u);
}

// Three fifths of the bar come off; the rest hangs where it is held, small as it is.
TEST(VolumeParts, the_part_that_nothing_holds_is_the_freed_one) {
  for (const FreeParts free_parts : {FreeParts::keep, FreeParts::deformable, FreeParts::rigid}) {
    Operation op(hanging_bar("neo_hookean", "progressive", free_parts));
    RunOutcome outcome(op.simulation);
    for (double y_m = -0.02; y_m < 0.02; y_m += 4e-5) {
      op.step({{0, flat(y_m, -0.03)}});
      outcome.add(op.last);
    }
    const Outcome found = outcome.finish({});
    EXPECT_EQ(found.pieces_freed, 1);
    EXPECT_NEAR(found.freed_ml, 20, 2);
  }
}

// Two blades at work in the same steps, at heights of their own.
TEST(VolumeParts, two_blades_in_one_step_make_three_bodies) {
  Operation op(hanging_bar("neo_hookean", "progressive", FreeParts::deformable, 2));
  const double z_m[] = {-0.03, -0.055};
  std::size_t both = 0;
  for (double y_m = -0.02; y_m < 0.025; y_m += 4e-5) {
    op.step({{0, flat(y_m, z_m[0])}, {1, flat(y_m + 0.005, z_m[1])}});  // the lower part comes off first
    both += op.last.contacts[0].state == ContactState::penetration &&
            op.last.contacts[1].state == ContactState::penetration;
  }
  EXPECT_GT(both, 50u);
  EXPECT_EQ(op.simulation.body_count(), 3u);
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
}

// The side through which the blade came is open, too, although the blade had pressed it in.
TEST(VolumeParts, a_cut_begins_at_the_skin) {
  for (const std::string style : {"semi_progressive", "progressive"}) {
    Scene scene = prepared(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/bar_volume_cut.yaml", standard_traits()));
    scene.bodies[0].cutting.style = style;
    Operation op(scene);
    for (int n = 0; n < 1500; ++n) {
      const TracePoint at = point_at(scene.tools[0].trace, n * Operation::kSample_s);
      op.step({{0, at.pose_world}});
    }
    double first_m = 1, last_m = -1, face_m = 1;
    for (const Triangle& t : op.mesh().triangles())
      for (const VertexId v : t.v) {
        if (!t.alive()) continue;
        const double y_m = op.mesh().rest_body_m(v).y();
        face_m = std::min(face_m, y_m);
        if (t.surface != Surface::wall) continue;
        first_m = std::min(first_m, y_m);
        last_m = std::max(last_m, y_m);
      }
    EXPECT_NEAR(first_m, face_m, 1e-4) << style;
    EXPECT_GT(last_m, face_m + 0.005) << style;
  }
}

// The blade is taken out on the way, and goes on later, wherever that was.
TEST(VolumeParts, a_cut_that_is_resumed_goes_through) {
  for (const auto& [z_m, until_m] : {std::pair{-0.02, -0.002}, {-0.03, 0.001}, {-0.045, -0.004}, {-0.06, 0.003}}) {
    Operation op(hanging_bar("neo_hookean", "progressive", FreeParts::deformable));
    op.place(flat(-0.015, z_m).position_m, flat(0, 0).orientation);
    for (double y_m = -0.015; y_m < until_m; y_m += 4e-5) op.step({{0, flat(y_m, z_m)}});
    EXPECT_EQ(op.simulation.body_count(), 1u);
    EXPECT_GT(op.walls(), 10u);
    const auto cuts = op.last.report.cuts_made;
    for (double y_m = until_m; y_m > -0.02; y_m -= 4e-5) op.step({{0, flat(y_m, z_m)}});
    op.rest(200);
    cut_through(op, z_m);
    EXPECT_GT(op.last.report.cuts_made, cuts + 5);
    EXPECT_EQ(op.simulation.body_count(), 2u) << z_m;
  }
}

TEST(VolumeParts, a_blade_that_is_drawn_straight_out_has_left_its_cut) {
  Operation op(hanging_bar("neo_hookean", "progressive", FreeParts::keep));
  op.place(flat(-0.015, -0.03).position_m, flat(0, 0).orientation);
  for (double y_m = -0.015; y_m < 0; y_m += 4e-5) op.step({{0, flat(y_m, -0.03)}});
  ASSERT_EQ(op.state(), ContactState::penetration);
  for (double out_m = 0; out_m < 0.06; out_m += 2e-4) {
    Pose pose = flat(0, -0.03);
    pose.position_m += pose.orientation * Vec3(0, 0, out_m);
    op.step({{0, pose}});
  }
  EXPECT_EQ(op.state(), ContactState::free);
  EXPECT_EQ(op.count(EventKind::cut_ended), 1u);
}

// How far behind the blade's edge the opening ends, in each half of the bar, over a stroke; in mean edges.
struct Opening {
  double most_behind = -1, most_ahead = -1;
  std::uint32_t steps = 0;
};
Opening opening_along(const std::string& style, double step_m) {
  const Scene scene = prepared(hanging_bar("neo_hookean", style, FreeParts::keep));
  const double edge_m = mean_edge_m(scene.bodies[0].tets);
  const InstrumentShape shape = instrument_of("knife").shape(scene.tools[0].geometry, {});
  Operation op(scene);
  Opening opening;
  op.place(flat(-0.015, -0.03).position_m, flat(0, 0).orientation);
  for (double y_m = -0.015; y_m < 0.004; y_m += step_m) {
    op.step({{0, flat(y_m, -0.03)}});
    if (op.state() != ContactState::penetration || y_m < -0.003) continue;
    ++opening.steps;
    const Vec3 tip = flat(y_m, -0.03).to_world(shape.edge_tip_tool_m),
               heel = flat(y_m, -0.03).to_world(shape.edge_heel_tool_m);
    std::array<double, 2> behind_m{1, 1};
    for (const Triangle& t : op.mesh().triangles()) {
      if (!t.alive() || t.surface != Surface::wall) continue;
      for (const VertexId v : t.v) {
        const Vec3 x = op.simulation.positions_world_m(0)[v].cast<double>();
        const double edge_y_m = tip.y() + (heel.y() - tip.y()) * (x.x() - tip.x()) / (heel.x() - tip.x());
        double& least = behind_m[x.x() > 0];
        least = std::min(least, edge_y_m - x.y());
      }
    }
    for (const double m : behind_m) {
      opening.most_behind = std::max(opening.most_behind, m / edge_m);
      opening.most_ahead = std::max(opening.most_ahead, -m / edge_m);
    }
  }
  return opening;
}

// Wherever in an element the blade is.
TEST(VolumeParts, C_CUT_3_a_progressive_cut_is_open_up_to_the_blade_and_no_further) {
  const Opening progressive = opening_along("progressive", 2e-5);
  EXPECT_GT(progressive.steps, 200u);
  EXPECT_LT(progressive.most_behind, 0.15);
  EXPECT_LT(progressive.most_ahead, 0.15);
  EXPECT_GT(opening_along("semi_progressive", 4e-5).most_behind, 0.5);
}

}  // namespace
}  // namespace sectio::simulation_test
