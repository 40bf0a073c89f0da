// Paper B in the whole simulation: searching, springs of new vertices, input devices, forces; paper A: no instrument
// inside tissue that it has not cut, and who finds the points of intersection.
#include <gtest/gtest.h>

#include <map>

#include "common/math/intersect.h"
#include "common/math/trace.h"
#include "common/mesh/check.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/world/body.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

// Original edges that cuts have opened or that groove walls cross, by the pairs of vertices that are on them at rest.
using Edge = std::pair<VertexId, VertexId>;
std::set<Edge> crossed_edges(const TriangleMesh& before, const TriangleMesh& after) {
  std::set<Edge> still;
  for (const Triangle& t : after.triangles())
    if (t.alive())
      for (std::size_t i = 0; i < 3; ++i) still.insert(std::minmax(t.v[i], t.v[(i + 1) % 3]));
  std::set<Edge> crossed;
  for (const Triangle& t : before.triangles())
    for (std::size_t i = 0; i < 3; ++i)
      if (const Edge e = std::minmax(t.v[i], t.v[(i + 1) % 3]); !still.contains(e)) crossed.insert(e);
  return crossed;
}

TEST(B_CD, B_CD_11_one_global_search_a_cut_while_motion_is_quasi_static) {
  Operation op(organ_scene());
  op.place({-0.02, 0.001, organ_height_m(-0.02, 0.001) + 0.004});
  op.tip_to(-0.02, 0.001, kStrokeDepth_m, 0.05);
  op.tip_to(0.02, 0.001, kStrokeDepth_m, 0.05);
  EXPECT_GT(op.walls(), 40u);
  EXPECT_EQ(op.last.report.global_searches, 1u) << "only to find the first triangle";
  EXPECT_GT(op.last.report.local_searches, 0u);
}

struct Jump {
  std::set<Edge> crossed;
  std::uint64_t global_searches = 0;
};
Jump cut_with(double speed_m_per_s) {
  Operation op(organ_scene());
  const TriangleMesh before = op.mesh();
  op.place({-0.02, 0.001, organ_height_m(-0.02, 0.001) + 0.004});
  op.tip_to(-0.02, 0.001, kStrokeDepth_m);
  op.tip_to(-0.018, 0.001, kStrokeDepth_m);
  op.rest(100);
  op.tip_to(0.02, 0.001, kStrokeDepth_m, speed_m_per_s);
  op.expect_valid();
  op.rest(5);
  const std::set<Edge> crossed = crossed_edges(before, op.mesh());  // once the blade has left, slivers are mended
  op.tip_to(0.02, 0.001, -0.01);
  EXPECT_EQ(op.last.report.cuts_refused, 0u);
  return {crossed, op.last.report.global_searches};
}

TEST(B_CD, B_CD_11_fast_motion_cuts_all_that_lies_on_its_way) {
  const Jump slow = cut_with(0.02), fast = cut_with(2), jump = cut_with(1e9);
  EXPECT_GT(slow.crossed.size(), 8u);
  EXPECT_EQ(fast.crossed, slow.crossed);
  EXPECT_EQ(jump.crossed, slow.crossed) << "38 mm between two samples";
}

TEST(B_CD, B_CD_11_a_jump_into_the_tissue_is_contact) {
  Scene scene = organ_scene();
  scene.bodies[0].cutting.threshold_force_n = 50;
  Operation op(scene);
  op.place({0, 0.001, kOrganTop_m + 0.015});
  op.place({0, 0.001, kOrganTop_m - 0.010});
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_EQ(op.last.report.global_searches, 1u);
  EXPECT_LT(op.last.report.penetration_m, 1e-6) << "and the skin is at the tip";
}

TEST(B_CD, B_CD_11_dropped_samples_bring_the_global_search_back) {
  Operation op(organ_scene());
  op.place({0, 0.001, kOrganTop_m + 0.004});
  StepInput input;
  for (int i = 1; i <= 60; ++i) {
    ToolSample s = op.sample(0, {Vec3(0, 0.001, kOrganTop_m + 0.004 - 1e-4 * i), Eigen::Quaterniond::Identity()});
    if (i % 10 != 0) continue;  // nine of ten get lost
    input.samples = {s};
    op.step(input);
  }
  EXPECT_GT(op.last.report.global_searches, 0u);
  EXPECT_EQ(op.last.report.local_searches, 0u);
}

// New vertices: a cut in a body that feels no force but that of its springs.
struct CutBody {
  CutBody() : scene(still_scene()), body(scene.bodies[0], scene, 0, surface_spring_engines) {
    const Vec3 top(0, 0, 1);
    TriangleId nearest = 0;
    for (TriangleId t = 0; t < body.mesh.triangle_slots(); ++t)
      if (centre(t).dot(top) - 10 * std::abs(centre(t).x() + 0.01) >
          centre(nearest).dot(top) - 10 * std::abs(centre(nearest).x() + 0.01))
        nearest = t;
    original_vertices = body.mesh.vertex_slots();
    std::vector<Entry> entries{{0, nearest, Vec3::Constant(1.0 / 3)}};
    const Vec3 start = centre(nearest);
    for (int i = 0; i < 40; ++i) {
      const double x = start.x() + 5e-4 * i;
      const Vec3 tip(x, start.y(), organ_height_m(x, start.y()) - kStrokeDepth_m);
      apply_plan(entries, {0, {{tip, Vec3::UnitZ(), 1e9}}, false});
      entries.clear();
    }
    apply_plan(entries, {0, {}, true});
    EXPECT_GT(body.mesh.vertex_slots(), original_vertices + 15);
  }
  static Scene still_scene() {
    Scene scene = organ_scene();
    scene.bodies[0].material.pretension = 0;
    scene.bodies[0].fixed.reset();
    return scene;
  }
  Vec3 centre(TriangleId t) const {
    const auto& v = body.mesh.triangle(t).v;
    return (body.mesh.rest_body_m(v[0]) + body.mesh.rest_body_m(v[1]) + body.mesh.rest_body_m(v[2])) / 3;
  }
  void apply_plan(const std::vector<Entry>& entries, BladeMotion motion) {
    for (TriangleId t = 0; t < body.mesh.triangle_slots(); ++t) motion.active.push_back(t);  // any may be crossed
    const CutPlan plan = body.engines.cutting->plan(body.shared(), entries, std::array{motion});
    EXPECT_TRUE(body.apply(cut_as_planned(plan)));
  }
  Vec3 position(VertexId v) const { return body.particles.position_world_m[v].head<3>().cast<double>(); }

  Scene scene;
  Body body;
  VertexId original_vertices = 0;
};

TEST(B_MSM, B_MSM_3_new_vertices_have_a_spring_an_edge_and_a_home_spring) {
  const CutBody cut;
  const TriangleMesh& mesh = cut.body.mesh;
  std::map<VertexId, std::set<VertexId>> neighbours;
  for (const Triangle& t : mesh.triangles())
    if (t.alive())
      for (std::size_t i = 0; i < 3; ++i) {
        neighbours[t.v[i]].insert(t.v[(i + 1) % 3]);
        neighbours[t.v[(i + 1) % 3]].insert(t.v[i]);
      }
  const SpringRows& rows = dynamic_cast<const SurfaceSprings&>(*cut.body.engines.deformation).rows();
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    ASSERT_TRUE(rows.contains(v));
    std::set<VertexId> springs;
    for (std::uint32_t n = 0; n < rows.degree(v); ++n) springs.insert(rows.half_edge(v, n).to);
    EXPECT_EQ(springs, neighbours[v]) << "vertex " << v;
    const VertexRow row = rows.row(v);
    EXPECT_LT((row.home_world_m.cast<double>() - mesh.rest_body_m(v)).norm(), 1e-6) << "its own initial position";
    EXPECT_GT(row.k_home, 0) << "vertex " << v;
  }
}

TEST(B_MSM, B_MSM_3_new_vertices_stay_at_home_and_come_back_to_it) {
  CutBody cut;
  Body& body = cut.body;
  for (int i = 0; i < 300; ++i) body.deform({}, {}, cut.scene.step_s);
  for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v)
    if (body.mesh.vertex_alive(v)) {
      ASSERT_LT((cut.position(v) - body.mesh.rest_body_m(v)).norm(), 2e-6) << "vertex " << v;
    }
  for (VertexId v = cut.original_vertices; v < body.mesh.vertex_slots(); ++v)
    if (body.mesh.vertex_alive(v)) body.particles.place(v, cut.position(v) + Vec3(2e-4, -1e-4, 2e-4));
  for (int i = 0; i < 3000; ++i) body.deform({}, {}, cut.scene.step_s);
  for (VertexId v = cut.original_vertices; v < body.mesh.vertex_slots(); ++v)
    if (body.mesh.vertex_alive(v)) {
      EXPECT_LT((cut.position(v) - body.mesh.rest_body_m(v)).norm(), 2e-5) << "vertex " << v;
    }
}

TEST(B_SUB, B_SUB_1_springs_move_the_pair_apart) {
  Operation op(organ_scene());
  op.place({-0.02, 0.001, organ_height_m(-0.02, 0.001) + 0.004});
  op.tip_to(-0.02, 0.001, kStrokeDepth_m);
  op.tip_to(0.02, 0.001, kStrokeDepth_m);
  op.tip_to(0.022, 0.001, -0.01);
  op.rest(500);
  std::map<std::tuple<double, double, double>, std::vector<VertexId>> at;
  for (VertexId v = 0; v < op.mesh().vertex_slots(); ++v)
    if (op.mesh().vertex_alive(v)) {
      const Vec3& x = op.mesh().rest_body_m(v);
      at[{x.x(), x.y(), x.z()}].push_back(v);
    }
  int pairs = 0;
  for (const auto& [x, v] : at) {
    if (v.size() != 2) continue;
    ++pairs;
    const auto p = op.simulation.positions_world_m(0);
    EXPECT_GT((p[v[0]] - p[v[1]]).norm(), 1e-4f) << "at x = " << std::get<0>(x);
  }
  EXPECT_GT(pairs, 5);
}

// The same hand, recorded by three devices and played back as the bridge does: by a sample a millisecond.
struct Device {
  const char* name;
  std::vector<double> sample_times_s;
};
Device device(const char* name, double rate_hz, double jitter, double duration_s) {
  Device d{name, {}};
  std::uint64_t random = 12345;
  for (int i = 0; i / rate_hz < duration_s; ++i) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    const double u = static_cast<double>(random >> 40) / static_cast<double>(1 << 24) - 0.5;
    d.sample_times_s.push_back(std::max(0.0, (i + jitter * u) / rate_hz));
  }
  return d;
}

TEST(B_IN, B_IN_1_haptic_device_joystick_and_mouse_make_the_same_cut) {
  // Down in 0.5 s, a pause, along a gentle arc in 2 s, a pause, out.
  const auto hand = [](double t) -> Pose {
    const double along = std::clamp((t - 0.8) / 2.0, 0.0, 1.0);
    const double x = -0.021 + 0.041 * along, y = 0.003 + 0.004 * std::sin(2 * along);
    const double down = t < 3.2 ? std::clamp(t / 0.5, 0.0, 1.0) : 1 - std::clamp((t - 3.2) / 0.3, 0.0, 1.0);
    return {Vec3(x, y, organ_height_m(x, y) + 0.006 - 0.010 * down), Eigen::Quaterniond::Identity()};
  };
  std::vector<std::pair<std::uint32_t, std::set<Edge>>> results;
  for (const Device& d : {device("haptic device, 1 kHz", 1000, 0, 3.6), device("joystick, 100 Hz", 100, 0, 3.6),
                          device("mouse, 60 Hz and irregular", 60, 0.8, 3.6)}) {
    std::vector<TracePoint> recorded;
    for (const double t : d.sample_times_s) recorded.push_back({t, hand(t)});
    Operation op(organ_scene());
    const TriangleMesh before = op.mesh();
    for (int k = 1; k <= 3700; ++k) op.step({{0, pose_at(recorded, k * 1e-3)}});
    EXPECT_EQ(op.count(EventKind::penetrated), 1u) << d.name;
    EXPECT_EQ(op.count(EventKind::cut_ended), 1u) << d.name;
    op.expect_valid();
    results.emplace_back(op.mesh().triangle_count(), crossed_edges(before, op.mesh()));
    EXPECT_GT(results.back().second.size(), 8u);
    EXPECT_EQ(results.back(), results.front()) << d.name;
  }
}

TEST(B_FUT, B_FUT_1_the_server_says_a_force_that_a_hand_can_feel) {
  Scene scene = organ_scene();
  scene.bodies[0].cutting.threshold_force_n = 50;
  Operation op(scene);
  op.place({0, 0.001, kOrganTop_m + 0.004});
  double before_n = 0;
  for (const double depth_m : {0.002, 0.003, 0.004}) {
    op.tip_to(0, 0.001, depth_m);
    op.rest(300);
    const ContactModel& model = op.last.contacts[0];
    const double force_n = model.force_world_n.z();
    EXPECT_GT(force_n, before_n + 0.02) << "deeper is harder";
    EXPECT_LT(model.force_world_n.head<2>().norm(), 0.1 * force_n) << "along the normal";
    EXPECT_GT(model.stiffness_n_per_m, 10);
    EXPECT_NEAR(dent_of(model, {model.tool_time_s, op.hand().position_m, Vec3::Zero(), Vec3::Zero()}).depth_m, depth_m,
                7e-4);
    before_n = force_n;
  }
}

TEST(B_FUT, B_FUT_4_a_loop_divides_a_body_that_goes_on_in_two_parts) {
  Scene scene = organ_scene();
  scene.tools[0].geometry.c_tool_m = Vec3(0.001, 0, 0.012);
  Operation op(scene);
  const double r = 0.014;
  // The sharp side turns with the circle.
  const auto pose = [&](double angle, double depth_m) -> Pose {
    const double x = r * std::cos(angle), y = r * std::sin(angle);
    return {Vec3(x, y, organ_height_m(x, y) - depth_m),
            Eigen::Quaterniond(Eigen::AngleAxisd(angle + M_PI / 2, Vec3::UnitZ()))};
  };
  op.step({{0, pose(0, -0.004)}});
  for (int i = 0; i <= 400; ++i) op.step({{0, pose(0, -0.004 + 0.008 * i / 400)}});
  for (int i = 0; i <= 3000 && op.count(EventKind::joined) == 0; ++i)
    op.step({{0, pose(i * 2.1 * M_PI / 3000, kStrokeDepth_m)}});
  EXPECT_EQ(op.count(EventKind::joined), 1u);
  ASSERT_EQ(op.count(EventKind::island_freed), 1u);
  op.tip_to(0, 0, -0.02, 0.1);
  op.rest(200);
  const SurfaceReport report = check(op.mesh());
  EXPECT_TRUE(report.valid()) << report.first_defect;
  EXPECT_EQ(report.components, 2u);
  EXPECT_EQ(report.euler_characteristic, 4);
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
}

// Distance of a point beneath the nearest triangle, by trying all of them; negative outside.
double beneath_surface_m(const Simulation& simulation, const Vec3& x) {
  const TriangleMesh& mesh = simulation.mesh(0);
  const auto p = simulation.positions_world_m(0);
  double least = 1e300, beneath = 0;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive()) continue;
    const Corners c{p[t.v[0]].cast<double>(), p[t.v[1]].cast<double>(), p[t.v[2]].cast<double>()};
    const ClosestPoint at = closest_on_triangle(x, c);
    if (at.squared_distance >= least) continue;
    least = at.squared_distance;
    const Vec3 n = (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized();
    beneath = n.dot(at.point - x) > 0 ? std::sqrt(least) : -std::sqrt(least);
  }
  return beneath;
}

TEST(A_ARCH, A_ARCH_5_the_tip_is_never_inside_tissue_that_it_has_not_cut) {
  Scene scene = organ_scene();
  scene.bodies[0].cutting.threshold_force_n = 5;
  Operation op(scene);
  int in_contact = 0, published = 0;
  double deepest_m = 0;
  op.after_each = [&](const StepOutput& out) {
    published += out.publish_now;
    if (out.contacts[0].state != ContactState::contact) return;
    EXPECT_TRUE(in_contact > 0 || out.publish_now) << "the first contact is published at once";
    ++in_contact;
    deepest_m = std::max(deepest_m, beneath_surface_m(op.simulation, op.hand().position_m));
  };
  op.place({-0.015, 0.001, organ_height_m(-0.015, 0.001) + 0.004});
  op.tip_to(-0.015, 0.001, 0.003, 0.1);
  op.tip_to(0.015, 0.004, 0.005, 0.1);  // sliding and pressing on
  EXPECT_LT(deepest_m, 2e-5);
  op.tip_to(-0.01, -0.01, 0.001, 0.5);  // fast
  EXPECT_LT(deepest_m, 1.5e-4) << "what a pixel shows";
  op.tip_to(-0.01, -0.01, 0.008, 1.0);  // a stab, eight millimetres in eight steps
  op.rest(50);
  EXPECT_GT(in_contact, 300);
  EXPECT_LT(deepest_m, 5e-4);
  EXPECT_NEAR(op.deepest_m, deepest_m, 1e-5) << "and the report says so";
  EXPECT_GE(published, 1);
}

// Cutting takes the point that collision finds: the first point of a cut is the entry, bit for bit.
TEST(A_ARCH, A_ARCH_13_cutting_takes_the_points_that_collision_found) {
  CutBody cut;
  const Vec3 bary(0.25, 0.4375, 0.3125);
  TriangleId far = kNone;
  for (TriangleId t = 0; t < cut.body.mesh.triangle_slots() && far == kNone; ++t)
    if (cut.body.mesh.triangle(t).alive() && cut.centre(t).x() < -0.03 && cut.centre(t).z() > 0.015) far = t;
  ASSERT_NE(far, kNone);
  const auto v = cut.body.mesh.triangle(far).v;
  const auto& m = cut.body.mesh;
  const Vec3 point = bary[0] * m.rest_body_m(v[0]) + bary[1] * m.rest_body_m(v[1]) + bary[2] * m.rest_body_m(v[2]);
  const VertexId slots = m.vertex_slots();
  const Vec3 ahead = point + Vec3(0.002, 0.001, -0.003);
  cut.apply_plan({{7, far, bary}}, {7, {{ahead, Vec3::UnitZ(), 1e9}}, false});
  bool found = false;
  for (VertexId w = 0; w < m.vertex_slots(); ++w) found |= m.vertex_alive(w) && m.rest_body_m(w) == point;
  EXPECT_TRUE(found) << "a vertex at the very point";
  EXPECT_GT(m.vertex_slots(), slots);
}

TEST(B_STATE, two_instruments_in_the_same_triangle) {
  Scene scene = organ_scene();
  scene.bodies[0].mesh = ellipsoid(2, Vec3(0.06, 0.06, kOrganTop_m));  // triangles of 15 mm
  scene.tools.push_back(scene.tools[0]);
  scene.tools[1].name = "second scalpel";
  Operation op(scene);
  const auto at = [](double x, double y, double depth_m) -> Pose {
    return {Vec3(x, y, organ_height_m(x, y) - depth_m), Eigen::Quaterniond::Identity()};
  };
  const auto both = [&](double x, double depth_m) {
    op.step({{0, at(x, 0.0035, depth_m)}, {1, at(x - 0.004, 0.0065, depth_m)}});
    ASSERT_NO_FATAL_FAILURE(op.expect_valid());
  };
  op.step({{0, at(-0.01, 0.0035, -0.004)}, {1, at(-0.014, 0.0065, -0.004)}});
  for (int i = 0; i < 500; ++i) both(-0.01, -0.004 + 1.8e-5 * i);
  EXPECT_EQ(op.state(0), ContactState::penetration);
  EXPECT_EQ(op.state(1), ContactState::penetration);
  for (int i = 0; i < 1200; ++i) both(-0.01 + 2e-5 * i, 0.005);
  EXPECT_EQ(op.state(0), ContactState::penetration);
  EXPECT_EQ(op.state(1), ContactState::penetration);
  EXPECT_EQ(op.last.report.cuts_refused, 0u);
  for (int i = 0; i < 500; ++i) both(0.014, 0.005 - 3e-5 * i);
  EXPECT_EQ(op.state(0), ContactState::free);
  EXPECT_EQ(op.state(1), ContactState::free);
}

}  // namespace
}  // namespace sectio::test
