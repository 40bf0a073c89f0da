// Paper A, section 2.2, in the whole simulation: temporary elements under instruments that press, and their end.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/delta/keyframe.h"
#include "common/mesh/check.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/world/indentation.h"
#include "tests/support/loop_cut.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

// The organ, and instruments that press it: a probe, or several.
Scene pressed_scene(std::size_t probes = 1, const char* style = "templates") {
  Scene scene = organ_scene();
  scene.bodies[0].contact.style = style;
  scene.tools.assign(probes, scene.tools[0]);
  for (std::size_t i = 0; i < probes; ++i) {
    scene.tools[i].name = "probe" + std::to_string(i);
    scene.tools[i].kind = "probe";
    scene.tools[i].geometry = instrument_of("probe").geometry;
    scene.tools[i].geometry.sphere_radius_m = 0;  // the paper's instruments are lines
  }
  return scene;
}
Scene with_scalpel(Scene scene, const char* cutting) {
  scene.tools.insert(scene.tools.begin(), organ_scene().tools[0]);
  scene.bodies[0].cutting.style = cutting;
  return scene;
}

// Leans the shaft from the vertical towards a direction, so that the side presses, too.
Eigen::Quaterniond lean(double angle_rad, const Vec3& towards) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Vec3::UnitZ().cross(towards).normalized()));
}

// Every delta that the simulation gives out goes to a replica of each body, and to one that joins late.
class Pressing : public Operation {
 public:
  explicit Pressing(Scene s) : Operation(std::move(s)), before(mesh()) {
    replicas.push_back(mesh());
    after_each = [this](const StepOutput& out) { follow(out); };
  }
  void join_late() {
    late = mesh_of(*keyframe_from_bytes(to_bytes(keyframe_of(mesh()))));
    ASSERT_TRUE(late);
  }
  void lift(std::uint32_t tool = 0) { move(hand(tool).position_m + Vec3(0, 0, 0.03), 0.1, tool); }
  // Until all is at rest.
  void wait_for_rest(int steps = 2000) {
    for (int i = 0; i < steps && mesh().has_temporary_elements(); ++i) rest(1);
  }

  const TriangleMesh before;
  std::vector<TriangleMesh> replicas;
  std::optional<TriangleMesh> late;
  std::size_t permanent = 0, temporary = 0, most_vertices = 0;

 private:
  void follow(const StepOutput& out) {
    for (const NewBody& b : out.new_bodies) {
      ASSERT_EQ(b.body_id, replicas.size());
      replicas.push_back(simulation.mesh(b.body_id));
    }
    for (const BodyDelta& d : out.deltas) {
      ++(d.delta.temporary ? temporary : permanent);
      const std::optional<TopologyDelta> sent = delta_from_bytes(to_bytes(d.delta));
      ASSERT_EQ(*sent, d.delta);
      if (replicas[d.body_id].revision() >= sent->revision) continue;  // the body has come with it
      ASSERT_EQ(apply(*sent, replicas[d.body_id]), ApplyStatus::applied);
      if (late && d.body_id == 0) {
        ASSERT_EQ(apply(*sent, *late), ApplyStatus::applied);
      }
    }
    for (std::uint32_t b = 0; b < replicas.size(); ++b) ASSERT_EQ(replicas[b].hash(), simulation.mesh(b).hash());
    most_vertices = std::max<std::size_t>(most_vertices, mesh().vertex_count());
  }
};

constexpr double kPress_m = 0.004;

TEST(A_DEF, A_DEF_8_all_is_as_before_once_the_face_has_its_shape_on_the_server_and_on_replicas) {
  Pressing op(pressed_scene());
  op.place({0.003, 0.002, kOrganTop_m + 0.003});
  op.tip_to(0.003, 0.002, kPress_m);
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_TRUE(op.mesh().has_temporary_elements());
  EXPECT_EQ(op.mesh().permanent_hash(), op.before.hash());
  op.expect_valid();
  op.join_late();
  op.tip_to(0.012, 0.004, kPress_m);
  op.lift();
  EXPECT_EQ(op.state(), ContactState::free);
  EXPECT_TRUE(op.mesh().has_temporary_elements()) << "until the surface is at rest";
  op.wait_for_rest();
  EXPECT_TRUE(op.mesh().same_database(op.before));
  EXPECT_TRUE(op.replicas[0].same_database(op.before));
  EXPECT_TRUE(op.late->same_database(op.before)) << "who joined while it pressed";
  EXPECT_FALSE(op.late->has_temporary_elements());
}

// One body whose steps a test makes itself: what the simulation does, with a view of the springs.
struct PressedBody {
  PressedBody() : scene(pressed_scene()), body(scene.bodies[0], scene, 0, surface_spring_engines) {}
  const SpringRows& rows() const { return dynamic_cast<const SurfaceSprings&>(*body.engines.deformation).rows(); }
  ContactPoint point_in(TriangleId t, double depth_m) const {
    ContactPoint p;
    p.place.kind = PathPoint::Kind::in_face;
    p.place.face = original_surface(body).triangle(t).v;
    p.place.bary = Vec3(0.5, 0.3, 0.2);
    const VertexState at = state_at(original_surface(body), p.place);
    p.normal_world = body.undeformed_normal_world(original_surface(body), p.place.face, p.place.bary);
    p.target_world_m = at.position_world_m - depth_m * p.normal_world;
    return p;
  }
  void press(const std::vector<ContactPoint>& points) {
    std::vector<HeldParticle> held;
    watch_particles_let_go(body, points, scene.step_s);
    apply(plan_indentation(body, points, held));
    step(held);
  }
  void apply(const std::optional<Change>& change) { EXPECT_TRUE(!change || body.apply(*change)); }
  void step(const std::vector<HeldParticle>& held) {
    std::vector<PointConstraint> constraints;
    for (const HeldParticle& h : held) constraints.push_back(hold(h.vertex, h.target_world_m));
    std::vector<Reaction> reactions(constraints.size());
    body.deform(constraints, reactions, scene.step_s);
  }
  TriangleId top() const {
    TriangleId best = 0;
    const auto height = [&](TriangleId t) {
      const auto& v = body.mesh.triangle(t).v;
      return body.mesh.rest_body_m(v[0]).z() + body.mesh.rest_body_m(v[1]).z() + body.mesh.rest_body_m(v[2]).z();
    };
    for (TriangleId t = 0; t < body.mesh.triangle_slots(); ++t)
      if (height(t) > height(best)) best = t;
    return best;
  }
  Scene scene;
  Body body;
};

TEST(A_DEF, A_DEF_8_springs_and_masses_are_as_before_bit_for_bit) {
  PressedBody pressed, untouched;
  const TriangleId top = pressed.top(), beside = pressed.body.mesh.neighbour(top, 0);
  for (int i = 0; i < 40; ++i) pressed.press({pressed.point_in(top, 1e-4 * i), pressed.point_in(beside, 1e-4 * i)});
  EXPECT_NE(pressed.rows().degree(pressed.body.mesh.triangle(top).v[0]), 0u);
  const auto release = plan_release(pressed.body);
  ASSERT_TRUE(release);
  pressed.apply(release);
  ASSERT_TRUE(pressed.body.mesh.same_database(untouched.body.mesh));
  ASSERT_EQ(pressed.rows().row_count(), untouched.rows().row_count());
  const DeformationEngine &a = *pressed.body.engines.deformation, &b = *untouched.body.engines.deformation;
  for (VertexId v = 0; v < untouched.body.mesh.vertex_slots(); ++v) {
    ASSERT_EQ(pressed.rows().row(v), untouched.rows().row(v));
    ASSERT_EQ(pressed.rows().degree(v), untouched.rows().degree(v));
    for (std::uint32_t n = 0; n < untouched.rows().degree(v); ++n)
      ASSERT_EQ(pressed.rows().half_edge(v, n), untouched.rows().half_edge(v, n));
    ASSERT_DOUBLE_EQ(a.mass_kg(v), b.mass_kg(v)) << "sums go around a vertex from any triangle";
  }
  EXPECT_DOUBLE_EQ(a.largest_stable_step_s(), b.largest_stable_step_s());
  EXPECT_NEAR(a.diagnostics().added_mass_fraction, 0, 1e-12);
}

TEST(A_DEF, A_DEF_9_nothing_stays_fixed_after_the_step) {
  PressedBody pressed;
  const ContactPoint p = pressed.point_in(pressed.top(), 0.002);
  std::vector<HeldParticle> held;
  pressed.apply(plan_indentation(pressed.body, std::array{p}, held));
  ASSERT_EQ(held.size(), 1u);
  const VertexId v = held[0].vertex;
  EXPECT_GE(v, pressed.scene.bodies[0].mesh.vertices_body_m.size()) << "a new particle";
  pressed.step(held);
  const auto at = [&] { return pressed.body.particle_view().position(v); };
  EXPECT_LT((at() - p.target_world_m).norm(), 1e-6) << "held";
  for (VertexId x = 0; x < v; ++x)
    ASSERT_LT((pressed.body.particle_view().position(x) - pressed.body.mesh.rest_body_m(x)).norm(), 5e-4)
        << "original particles move by their springs alone";
  for (int i = 0; i < 3; ++i) pressed.step({});
  EXPECT_GT((at() - p.target_world_m).dot(p.normal_world), 1e-5) << "free";
}

TEST(A_DEF, A_DEF_10_ten_thousand_steps_of_contact_add_no_elements) {
  Pressing op(pressed_scene());
  op.place({0.01, 0, kOrganTop_m + 0.003});
  op.tip_to(0.01, 0, kPress_m);
  const std::size_t at_first = op.most_vertices;
  for (int i = 0; i < 10000; ++i) {
    const double a = 2e-3 * i;
    const double x = 0.012 * std::cos(a), y = 0.012 * std::sin(a);
    op.place({x, y, organ_height_m(x, y) - kPress_m},
             lean(0.6 * std::sin(0.7 * a), Vec3(-std::sin(a), std::cos(a), 0)));
  }
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_EQ(op.count(EventKind::contact_ended), 0u);
  EXPECT_LE(op.most_vertices, at_first + 6);
  EXPECT_LE(op.mesh().triangle_slots(), op.before.triangle_slots() + 2 * 8);
  op.lift();
  op.wait_for_rest();
  EXPECT_TRUE(op.mesh().same_database(op.before));
}

TEST(A_DEF, A_DEF_10_a_probe_that_rests_changes_no_topology) {
  Pressing op(pressed_scene());
  op.place({0.003, 0.002, kOrganTop_m + 0.003});
  op.tip_to(0.003, 0.002, kPress_m);
  op.rest(200);
  const std::size_t deltas = op.deltas;
  op.rest(500);
  EXPECT_EQ(op.deltas, deltas);
  EXPECT_GT(op.force_n().norm(), 0.01) << "and still presses";
}

TEST(A_DEF, A_DEF_11_two_instruments_on_one_face_on_neighbours_and_apart) {
  Pressing op(pressed_scene(2));
  for (std::uint32_t tool : {0u, 1u})
    op.place({0.02 - 0.04 * tool, 0.001, kOrganTop_m + 0.004}, lean(0.2, Vec3::UnitX()), tool);
  op.tip_to(0.02, 0.001, kPress_m, 0.05, 0);
  op.tip_to(-0.02, 0.001, kPress_m, 0.05, 1);
  for (const double apart_m : {0.01, 0.004, 0.0015, 0.0003, 0.006}) {
    op.tip_to(apart_m / 2, 0.002, kPress_m, 0.05, 0);
    op.tip_to(-apart_m / 2, 0.002, kPress_m, 0.05, 1);
    op.rest(100);
    op.expect_valid();
    for (std::uint32_t tool : {0u, 1u}) {
      EXPECT_EQ(op.state(tool), ContactState::contact) << apart_m;
    }
    EXPECT_GT(op.force_n(0).z(), 0.005) << apart_m;
    // So close together they share a particle, which bears on one of them.
    EXPECT_GT(op.force_n(1).z() + (apart_m < 0.002) * op.force_n(0).z(), 0.005) << apart_m;
    EXPECT_LE(op.mesh().vertex_count(), op.before.vertex_count() + 12);
  }
  op.lift(0);
  op.rest(200);
  EXPECT_TRUE(op.mesh().has_temporary_elements()) << "the other one presses on";
  op.lift(1);
  op.wait_for_rest();
  EXPECT_TRUE(op.mesh().same_database(op.before));
}

TEST(A_DEF, A_DEF_12_the_same_press_leaves_a_smaller_gap_than_moving_vertices) {
  std::map<std::string, double> most_m;
  for (const char* style : {"vertices", "templates"}) {
    Scene scene = pressed_scene(1, style);
    scene.bodies[0].material.pretension = 0.06;
    Operation op(scene);
    op.place({0.0, 0.002, kOrganTop_m + 0.004}, lean(1.1, Vec3::UnitX()));
    op.tip_to(0.0, 0.002, 0.0045);
    for (int i = 0; i < 200; ++i) {
      op.place({5e-5 * i, 0.002, organ_height_m(5e-5 * i, 0.002) - 0.0045}, lean(1.1, Vec3::UnitX()));
      most_m[style] = std::max(most_m[style], op.simulation.contact_gap(0).gap_m);
    }
  }
  EXPECT_GT(most_m["vertices"], 0.0005);
  EXPECT_LT(most_m["templates"], 0.7 * most_m["vertices"]);
}

TEST(A_DEF, A_DEF_13_deformation_publishes_no_permanent_change) {
  Pressing op(pressed_scene());
  op.place({0.003, 0.002, kOrganTop_m + 0.003});
  op.tip_to(0.003, 0.002, kPress_m);
  op.tip_to(-0.012, 0.009, kPress_m);
  EXPECT_GT(op.temporary, 10u);
  EXPECT_EQ(op.permanent, 0u);
  EXPECT_EQ(op.last.report.cuts_made, 0u);
  EXPECT_EQ(op.mesh().permanent_hash(), op.before.hash());
}

class Styles : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(A_DEF, Styles, testing::Values("progressive", "templates"));

// The blade itself presses before it breaks the skin, and a probe presses beside the cut all the time.
TEST_P(Styles, A_DEF_11_cutting_never_sees_temporary_elements) {
  Pressing op(with_scalpel(pressed_scene(1), GetParam()));
  op.place({-0.01, 0.001, kOrganTop_m + 0.004}, Eigen::Quaterniond::Identity(), 0);
  op.place({0.0, 0.004, kOrganTop_m + 0.004}, lean(0.5, Vec3::UnitY()), 1);
  op.tip_to(0.0, 0.004, kPress_m, 0.05, 1);
  op.join_late();
  op.tip_to(-0.01, 0.001, 0.006, 0.02, 0);
  EXPECT_EQ(op.count(EventKind::penetrated), 1u);
  op.tip_to(0.012, 0.001, 0.006, 0.02, 0);
  EXPECT_EQ(op.state(0), ContactState::penetration);
  EXPECT_EQ(op.state(1), ContactState::contact);
  EXPECT_TRUE(op.mesh().has_temporary_elements());
  EXPECT_GT(op.permanent, 5u);
  EXPECT_EQ(op.last.report.cuts_refused, 0u);
  op.lift(0);
  op.lift(1);
  op.wait_for_rest();
  EXPECT_GT(op.walls(), 10u);
  EXPECT_FALSE(op.mesh().has_temporary_elements());
  EXPECT_TRUE(op.late->same_database(op.mesh()));
  op.expect_valid();
}

// A loop is cut out while a probe presses on what it will be parted from, or on the part itself.
TEST(A_DEF, A_DEF_11_a_part_comes_off_during_a_press) {
  for (const auto& [free_parts, x_m] : {std::pair(FreeParts::rigid, 0.03), std::pair(FreeParts::deformable, 0.0)}) {
    Scene scene = loop_scene(free_parts);
    scene.bodies[0].contact.style = "templates";
    scene.tools[1].kind = "probe";
    scene.tools[1].geometry = instrument_of("probe").geometry;
    Pressing op(scene);
    op.place({x_m, 0.002, kOrganTop_m + 0.004}, Eigen::Quaterniond::Identity(), 1);
    op.tip_to(x_m, 0.002, 0.003, 0.02, 1);
    EXPECT_TRUE(op.mesh().has_temporary_elements());
    op.join_late();
    cut_arc(op, 0, 375);
    lift(op);
    ASSERT_EQ(op.simulation.body_count(), 2u);
    EXPECT_EQ(op.state(1), ContactState::contact);
    op.lift(1);
    for (int i = 0; i < 3000 && (op.mesh(0).has_temporary_elements() || op.mesh(1).has_temporary_elements()); ++i)
      op.rest(1);
    for (std::uint32_t b : {0u, 1u}) {
      EXPECT_FALSE(op.mesh(b).has_temporary_elements()) << b;
      EXPECT_TRUE(check(op.mesh(b)).valid());
      EXPECT_TRUE(op.replicas[b].same_database(op.mesh(b)));
    }
    EXPECT_TRUE(op.late->same_database(op.mesh()));
  }
}

// Two probes and a scalpel anywhere, quick and slow, upright and flat; a viewer joins in the middle.
TEST_P(Styles, A_DEF_8_a_storm_of_instruments_leaves_no_temporary_element) {
  for (const unsigned seed : {1u, 2u, 1001u, 2002u}) {
    Pressing op(with_scalpel(pressed_scene(2), GetParam()));
    test::Random64 random(seed);
    const auto u = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    for (std::uint32_t tool : {0u, 1u, 2u})
      op.place({0.02 * tool - 0.02, 0, 0.05}, Eigen::Quaterniond::Identity(), tool);
    for (int stroke = 0; stroke < 40; ++stroke) {
      const auto tool = static_cast<std::uint32_t>(random() % 3);
      const double x = u(-0.03, 0.03), y = u(-0.03, 0.03);
      if (tool > 0) op.place(op.hand(tool).position_m, lean(u(-1.2, 1.2), Vec3(u(-1, 1), u(-1, 1), 0)), tool);
      op.tip_to(x, y, u(-0.006, 0.007), u(0.02, 0.5), tool);
      if (stroke == 20) op.join_late();
      if (stroke % 10 == 9) op.rest(20);
    }
    op.expect_valid();
    for (std::uint32_t tool : {0u, 1u, 2u}) op.lift(tool);
    op.wait_for_rest();
    EXPECT_FALSE(op.mesh().has_temporary_elements()) << seed;
    EXPECT_TRUE(op.late->same_database(op.mesh())) << seed;
    EXPECT_TRUE(op.replicas[0].same_database(op.mesh())) << seed;
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u) << seed;
    for (const Vec3f& x : op.simulation.positions_world_m(0)) ASSERT_TRUE(x.allFinite());
  }
}

TEST(A_DEF, A_DEF_8_a_storm_of_probes_alone_is_undone_bit_for_bit) {
  for (const unsigned seed : {4u, 5u}) {
    Pressing op(pressed_scene(3));
    test::Random64 random(seed);
    const auto u = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    for (std::uint32_t tool : {0u, 1u, 2u})
      op.place({0.02 * tool - 0.02, 0, 0.05}, Eigen::Quaterniond::Identity(), tool);
    for (int stroke = 0; stroke < 50; ++stroke) {
      const auto tool = static_cast<std::uint32_t>(random() % 3);
      op.place(op.hand(tool).position_m, lean(u(-1.2, 1.2), Vec3(u(-1, 1), u(-1, 1), 0)), tool);
      op.tip_to(u(-0.015, 0.015), u(-0.015, 0.015), u(-0.004, 0.01), u(0.02, 0.5), tool);
    }
    EXPECT_LE(op.most_vertices, op.before.vertex_count() + 30);
    op.expect_valid();
    for (std::uint32_t tool : {0u, 1u, 2u}) op.lift(tool);
    op.wait_for_rest();
    EXPECT_TRUE(op.mesh().same_database(op.before)) << seed;
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u) << seed;
    EXPECT_EQ(op.permanent, 0u);
  }
}

}  // namespace
}  // namespace sectio::test
