// Pieces that were cut free: rigid motion, momentum and support; and instruments that hold or press.
#include <gtest/gtest.h>

#include <numeric>

#include "sim_server/deformation/divided_constraints.h"
#include "sim_server/deformation/shape_matching.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::deformation_test {
namespace {

using test::Particles;

TriangleMesh two_bodies() {
  return TriangleMesh(test::joined(test::ellipsoid({0.03, 0.02, 0.015}, 2),
                                   test::moved(test::ellipsoid({0.012, 0.01, 0.006}, 1), Vec3(0, 0, 0.1))));
}

std::vector<VertexId> piece_of(const TriangleMesh& mesh) {
  std::vector<VertexId> piece;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (mesh.vertex_alive(v) && mesh.rest_body_m(v).z() > 0.05) piece.push_back(v);
  }
  return piece;
}

SurfaceSpringMaterial slack() {
  SurfaceSpringMaterial material;
  material.pretension = 0;
  material.damping_per_s = 0;
  return material;
}

TEST(ShapeMatching, finds_the_rotation_also_of_flat_and_turned_pieces) {
  test::Random random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 100; ++n) {
    Pose truth;
    truth.position_m = Vec3(unit(random), unit(random), unit(random));
    const double angle = (n % 31) * 0.1;
    truth.orientation = Eigen::AngleAxisd(angle, Vec3(unit(random), unit(random), unit(random)).normalized());
    std::vector<MatchedPoint> points;
    for (int i = 0; i < 12; ++i) {
      const Vec3 home(unit(random), unit(random), n % 2 == 0 ? 0 : unit(random));
      points.push_back({home, truth.to_world(home), 0.1 + std::abs(unit(random))});
    }
    const Pose found = match_shape(points, Pose{});
    EXPECT_LT((found.position_m - truth.position_m).norm(), 1e-6) << angle;
    EXPECT_LT(found.orientation.angularDistance(truth.orientation), 1e-6) << angle;
  }
}

TEST(ShapeMatching, keeps_the_last_frame_when_nothing_has_weight) {
  Pose last;
  last.position_m = Vec3(1, 2, 3);
  EXPECT_EQ(match_shape({}, last).position_m, last.position_m);
}

// Homes that lag behind a piece would brake it, in parts of steps and in implicit ones.
TEST(FreePiece, flies_as_far_however_its_steps_are_taken) {
  const TriangleMesh mesh = two_bodies();
  const std::vector<VertexId> piece = piece_of(mesh);
  for (const double skin_m : {0.002, 0.2, 100.0}) {
    SurfaceSpringMaterial material = slack();
    material.skin_thickness_m = skin_m;
    SurfaceSprings springs(mesh, {}, material, test::no_gravity());
    springs.set_component(1, piece, false);
    Particles p(mesh, {});
    for (const VertexId v : piece) p.v[v] = Vec4f(0.2f, 0, 0.1f, 0);
    p.run(springs, 200);
    EXPECT_EQ(springs.diagnostics().implicit_steps, skin_m > 1 ? 200u : 0u);
    EXPECT_EQ(springs.parts() == 1, skin_m < 0.01);
    for (const VertexId v : piece)
      EXPECT_LT((p.at(v) - mesh.rest_body_m(v) - Vec3(0.04, 0, 0.02)).norm(), 1e-4) << skin_m;
  }
}

TEST(FreePiece, turns_and_flies_without_spurious_force) {
  const TriangleMesh mesh = two_bodies();
  const std::vector<VertexId> piece = piece_of(mesh);
  SurfaceSprings springs(mesh, {}, slack(), test::no_gravity());
  springs.set_component(1, piece, false);
  EXPECT_FALSE(springs.anchored(1));
  EXPECT_TRUE(springs.anchored(0));
  Particles p(mesh, {});
  const Vec3 velocity(0.1, -0.05, 0.02), spin(1.0, 2.0, -0.5), centre(0, 0, 0.1);
  for (const VertexId v : piece) {
    p.v[v].head<3>() = (velocity + spin.cross(p.at(v) - centre)).cast<float>();
  }
  p.run(springs, 1000);
  for (const VertexId v : piece) {  // 2.3 rad later: still the same shape, at the right place
    for (const VertexId w : piece) {
      EXPECT_NEAR((p.at(v) - p.at(w)).norm(), (mesh.rest_body_m(v) - mesh.rest_body_m(w)).norm(), 1e-4);
    }
  }
  EXPECT_LT((springs.frame_world(1).to_world(centre) - (centre + 0.999 * velocity)).norm(), 1e-5);
  EXPECT_NEAR(springs.frame_world(1).orientation.angularDistance(Eigen::Quaterniond::Identity()), spin.norm(), 0.02);
}

TEST(FreePiece, keeps_momentum_and_angular_momentum_while_it_deforms) {
  const TriangleMesh mesh = two_bodies();
  const std::vector<VertexId> piece = piece_of(mesh);
  SurfaceSprings springs(mesh, {}, slack(), test::no_gravity());
  springs.set_component(1, piece, false);
  Particles p(mesh, {});
  test::Random random(4);
  std::uniform_real_distribution<float> unit(-0.1f, 0.1f);
  for (const VertexId v : piece) p.v[v].head<3>() = Vec3f(unit(random), unit(random), unit(random));
  const auto momenta = [&] {
    std::pair<Vec3, Vec3> sum(Vec3::Zero(), Vec3::Zero());
    for (const VertexId v : piece) {
      const Vec3 mv = springs.mass_kg(v) * p.v[v].head<3>().cast<double>();
      sum.first += mv;
      sum.second += p.at(v).cross(mv);
    }
    return sum;
  };
  const auto [linear, angular] = momenta();
  p.run(springs, 500);
  const auto [linear_after, angular_after] = momenta();
  EXPECT_LT((linear_after - linear).norm(), 1e-4 * linear.norm());
  EXPECT_LT((angular_after - angular).norm(), 1e-3 * angular.norm());
}

TEST(FreePiece, control_an_anchored_piece_is_pulled_back) {
  const TriangleMesh mesh = two_bodies();
  const std::vector<VertexId> piece = piece_of(mesh);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  springs.set_component(1, piece, true);
  Particles p(mesh, {});
  for (const VertexId v : piece) p.x[v].x() += 0.01f;
  p.run(springs, 2000);
  for (const VertexId v : piece) EXPECT_LT(std::abs(p.at(v).x() - mesh.rest_body_m(v).x()), 0.001);
}

TEST(FreePiece, one_with_a_fixed_vertex_is_anchored) {
  const TriangleMesh mesh = two_bodies();
  SurfaceSpringSettings settings;
  settings.fixed = [](const Vec3& home) { return home.z() > 0.105; };
  SurfaceSprings springs(mesh, {}, {}, settings);
  springs.set_component(1, piece_of(mesh), false);
  EXPECT_TRUE(springs.anchored(1));
}

TEST(FreePiece, falls_by_the_book_and_rests_on_its_bed) {
  const TriangleMesh mesh = two_bodies();
  const std::vector<VertexId> piece = piece_of(mesh);
  SurfaceSpringMaterial material;
  material.damping_per_s = 0;
  SurfaceSprings falling(mesh, {}, material, {});
  falling.set_component(1, piece, false);
  Particles p(mesh, {});
  p.run(falling, 100);
  EXPECT_NEAR(falling.frame_world(1).position_m.z(), -0.5 * 9.81 * 0.1 * 0.1, 0.001);

  SurfaceSprings springs(mesh, {}, {}, {});
  springs.set_component(1, piece, false);
  springs.set_bed(1, Vec3(0, 0, 0.06), Vec3(0, 0, 2));
  Particles q(mesh, {});
  q.run(springs, 3000);
  double lowest = 1;
  for (const VertexId v : piece) {
    lowest = std::min(lowest, q.at(v).z());
    EXPECT_LT(q.at(v).z(), 0.08);
    EXPECT_LT(q.v[v].norm(), 0.01);
  }
  EXPECT_NEAR(lowest, 0.06, 1e-6);
  EXPECT_EQ(springs.clamped(), 0u);
}

TEST(FreePiece, vertices_join_and_leave_with_their_neighbours) {
  TriangleMesh mesh = two_bodies();
  SurfaceSprings springs(mesh, {}, slack(), test::no_gravity());
  springs.set_component(1, piece_of(mesh), false);
  test::MeshEditor editor(mesh);
  const TriangleId on_piece = mesh.incident(piece_of(mesh).front());
  std::vector<VertexId> touched = editor.split_edge(mesh, on_piece, 0, 0.5);
  mesh = editor.mesh();
  springs.update(mesh, touched);
  EXPECT_EQ(springs.component_of(touched.back()), 1u);
  Particles p(mesh, {});
  p.run(springs, 10);
  touched = editor.undo();
  mesh = editor.mesh();
  springs.update(mesh, touched);
  EXPECT_EQ(springs.component_of(touched.front()), kNone);
  p.run(springs, 10);
  springs.set_component(0, piece_of(mesh), true);
  EXPECT_EQ(springs.rows().row(piece_of(mesh)[0]).home_world_m, mesh.rest_body_m(piece_of(mesh)[0]).cast<float>());
}

VertexId top_of(const TriangleMesh& mesh) {
  VertexId top = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (mesh.rest_body_m(v).z() > mesh.rest_body_m(top).z()) top = v;
  }
  return top;
}

TEST(PointConstraint, gives_the_elastic_force_of_what_it_holds) {
  const TriangleMesh mesh = test::organ(2);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  Particles p(mesh, {});
  p.run(springs, 2000);
  const VertexId top = top_of(mesh);
  const Vec3 at = p.at(top) - Vec3(0, 0, 0.003);
  const std::vector<PointConstraint> press{hold(top, at)};
  std::vector<Reaction> reactions(1);
  for (int n = 0; n < 3000; ++n) springs.step(p.x, p.v, press, reactions);
  EXPECT_LT((p.at(top) - at).norm(), 1e-7);
  EXPECT_TRUE(reactions[0].active);
  const Vec3 force = reactions[0].force_on_tool_n;
  EXPECT_GT(force.z(), 0.05);
  // The same force, applied by hand in the other direction, holds the same dent.
  SurfaceSprings again(mesh, {}, {}, test::no_gravity());
  Particles q(mesh, {});
  for (int n = 0; n < 5000; ++n) {
    again.add_force(top, -force);
    again.step(q.x, q.v);
  }
  EXPECT_LT((q.at(top) - at).norm(), 3e-5);
}

TEST(PointConstraint, unilateral_pushes_and_never_pulls) {
  const TriangleMesh mesh = test::organ(2);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  Particles p(mesh, {});
  p.run(springs, 2000);
  const Triangle& t = mesh.triangle(mesh.incident(top_of(mesh)));
  PointConstraint tip;
  tip.v = t.v;
  tip.w = {0.5, 0.3, 0.2};
  tip.unilateral = true;
  const auto point = [&] { return Vec3(0.5 * p.at(t.v[0]) + 0.3 * p.at(t.v[1]) + 0.2 * p.at(t.v[2])); };
  const Vec3 before = point();
  std::vector<Reaction> reactions(1);
  const auto run = [&](const Vec3& target, int steps) {
    tip.target_world_m = target;
    for (int n = 0; n < steps; ++n) springs.step(p.x, p.v, std::span(&tip, 1), reactions);
  };
  run(before + Vec3(0, 0, 0.001), 100);  // above the surface
  EXPECT_FALSE(reactions[0].active);
  run(before + Vec3(0.0005, 0, -0.002), 2000);  // pressed in, and aside without friction
  EXPECT_NEAR(point().z(), before.z() - 0.002, 1e-6);
  EXPECT_GT(reactions[0].force_on_tool_n.z(), 0.01);
  EXPECT_EQ(reactions[0].force_on_tool_n.head<2>(), Eigen::Vector2d::Zero());
  run(before + Vec3(0, 0, 0.005), 1);  // lifted away at once
  EXPECT_EQ(reactions[0].force_on_tool_n, Vec3::Zero());
  run(before + Vec3(0, 0, 0.005), 2000);
  EXPECT_LT((point() - before).norm(), 1e-5);
}

TEST(PointConstraint, several_on_one_triangle_are_met_together) {
  const TriangleMesh mesh = test::organ(2);
  SurfaceSprings springs(mesh, {}, {}, {});
  Particles p(mesh, {});
  const Triangle& t = mesh.triangle(5);
  std::vector<PointConstraint> constraints(2);
  constraints[0].v = constraints[1].v = t.v;
  constraints[0].w = {0.8, 0.1, 0.1};
  constraints[1].w = {0.1, 0.8, 0.1};
  constraints[0].target_world_m = p.at(t.v[0]) * 0.95;
  constraints[1].target_world_m = p.at(t.v[1]) * 0.97;
  std::vector<Reaction> reactions(2);
  springs.step(p.x, p.v, constraints, reactions);
  for (const PointConstraint& c : constraints) {
    const Vec3 at = c.w[0] * p.at(t.v[0]) + c.w[1] * p.at(t.v[1]) + c.w[2] * p.at(t.v[2]);
    EXPECT_LT((at - c.target_world_m).norm(), 1e-5);
  }
}

// A point that slides over a floor, comes off it and lands again within the substeps of one step.
TEST(PointConstraint, one_that_sticks_stops_a_point_where_it_lands_and_does_not_draw_it_back) {
  constexpr int kSubsteps = 100;
  constexpr double kStep_s = 0.001, kPart_s = kStep_s / kSubsteps;
  std::vector<Vec4f> x(1, Vec4f::Zero()), v(1, Vec4f(0.3f, 0, 0.001f, 0));
  const std::vector<double> inverse_mass{1 / 1e-6};
  PointConstraint floor = hold(0, Vec3::Zero());
  floor.unilateral = floor.sticks = true;
  floor.normal = -Vec3::UnitZ();
  DividedConstraints constraints;
  constraints.begin(std::span(&floor, 1), x, kSubsteps);
  for (int n = 0; n < kSubsteps; ++n) {
    if (n == kSubsteps / 2) v[0].z() = -0.002f;
    x[0] += static_cast<float>(kPart_s) * v[0];
    constraints.project_substep(n, kPart_s, inverse_mass, x, v);
    EXPECT_LE(v[0].norm(), 0.31) << n;
  }
  EXPECT_NEAR(x[0].x(), 0.3 * 0.75 * kStep_s, 0.02 * 0.3 * kStep_s);
  EXPECT_EQ(x[0].z(), 0);
  EXPECT_LT(v[0].norm(), 1e-3);
}

TEST(PointConstraint, what_cannot_move_gives_no_force) {
  const TriangleMesh mesh = test::organ(1);
  SurfaceSpringSettings settings;
  settings.fixed = [](const Vec3&) { return true; };
  SurfaceSprings springs(mesh, {}, {}, settings);
  Particles p(mesh, {});
  const Particles before = p;
  const PointConstraint c = hold(0, Vec3(1, 1, 1));
  std::vector<Reaction> reactions(1);
  springs.step(p.x, p.v, std::span(&c, 1), reactions);
  EXPECT_FALSE(reactions[0].active);
  EXPECT_EQ(p.x, before.x);
}

TEST(Displace, accounts_for_the_force) {
  const TriangleMesh mesh = test::organ(1);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  Particles p(mesh, {});
  const Vec3 force = springs.displace(3, Vec3(0, 0, 1e-4), p.x, p.v);
  EXPECT_NEAR(force.z(), -springs.mass_kg(3) * 1e-4 / 1e-6, 1e-9);
  EXPECT_NEAR(p.v[3].z(), 0.1, 1e-6);
}

}  // namespace
}  // namespace sectio::deformation_test
