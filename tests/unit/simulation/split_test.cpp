#include "sim_server/step/split.h"
#include "sim_server/surface/surface_engines.h"

#include <gtest/gtest.h>

#include <numeric>

#include "common/mesh/check.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/step/collide.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

TriangleSoup moved(TriangleSoup soup, const Vec3& by) {
  for (Vec3& p : soup.vertices_body_m) p += by;
  return soup;
}

// Balls of 20 mm and of other sizes side by side, as one body that nothing has looked at yet.
struct Row {
  explicit Row(FreeParts free_parts, const std::vector<double>& radii_m = {0.02, 0.012}, double fixed_below_x_m = -1) {
    spec.name = "row";
    spec.splitting.free_parts = free_parts;
    double x_m = 0;
    for (const double r : radii_m) {
      const TriangleSoup ball = moved(ellipsoid(2, Vec3::Constant(r)), Vec3(x_m, 0, 0));
      const auto first = static_cast<VertexId>(spec.mesh.vertices_body_m.size());
      spec.mesh.vertices_body_m.insert(spec.mesh.vertices_body_m.end(), ball.vertices_body_m.begin(),
                                       ball.vertices_body_m.end());
      for (const auto& t : ball.triangles) spec.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      x_m += 0.1;
    }
    if (fixed_below_x_m > -1) spec.fixed = Box{Vec3(-1, -1, -1), Vec3(fixed_below_x_m, 1, 1)};
    scene.file = "row";
    body = std::make_unique<Body>(spec, scene, 0, surface_spring_engines);
    body->unsettled.resize(body->mesh.triangle_slots());
    std::iota(body->unsettled.begin(), body->unsettled.end(), TriangleId{0});
  }

  Split split(std::uint32_t room = 10) { return split_body(*body, scene, 1, room, specs); }

  BodySpec spec;
  Scene scene;
  std::unique_ptr<Body> body;
  std::deque<BodySpec> specs;
};

struct Momenta {
  double volume_m3 = 0;
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};
void add(const Body& body, Momenta& sum) {
  sum.volume_m3 += check(body.mesh).volume_m3;
  for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v) {
    if (!body.mesh.vertex_alive(v)) continue;
    const Vec3 p = body.engines.deformation->mass_kg(v) * body.particle_view().velocity(v);
    sum.linear += p;
    sum.angular += body.particle_view().position(v).cross(p);
  }
}
bool anchored(const Body& body) {
  return dynamic_cast<const SurfaceSprings&>(*body.engines.deformation).anchored(0);
}
void stir(Body& body) {
  std::srand(3);
  for (auto& v : body.particles.velocity_world_m_per_s) v.head<3>() = Vec3f::Random();
  for (auto& x : body.particles.position_world_m) x.head<3>() += 1e-3f * Vec3f::Random();
}

class Policies : public testing::TestWithParam<FreeParts> {};
TEST_P(Policies, volume_and_both_momenta_are_kept) {
  Row row(GetParam(), {0.02, 0.012, 0.016});
  stir(*row.body);
  Momenta before, after;
  add(*row.body, before);
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 2u);
  add(*row.body, after);
  for (const auto& part : split.parts) add(*part, after);
  EXPECT_NEAR(after.volume_m3, before.volume_m3, 1e-12 * before.volume_m3);
  // Rigid velocities are stored as floats again, one rounding a vertex.
  EXPECT_LT((after.linear - before.linear).norm(), 1e-6 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-6 * before.angular.norm());
  EXPECT_GT(before.linear.norm() * before.angular.norm(), 0);
  for (const auto& part : split.parts) {
    EXPECT_EQ(part->rigid.has_value(), GetParam() == FreeParts::rigid);
    EXPECT_FALSE(anchored(*part));
  }
}
INSTANTIATE_TEST_SUITE_P(Free, Policies, testing::Values(FreeParts::rigid, FreeParts::deformable));

TEST(Split, a_rigid_part_weighs_what_it_holds_and_has_the_momentum_of_its_motion) {
  Row row(FreeParts::rigid);
  const Vec3 velocity(0.3, -0.2, 0.1), spin(1, 2, 3);
  for (VertexId v = 0; v < row.body->mesh.vertex_slots(); ++v)
    row.body->particles.velocity_world_m_per_s[v].head<3>() =
        (velocity + spin.cross(row.body->particle_view().position(v) - Vec3(0.1, 0, 0))).cast<float>();
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  const RigidBody& piece = split.parts[0]->rigid->body;
  const double mass = row.spec.material.density_kg_per_m3 * check(split.parts[0]->mesh).volume_m3;
  EXPECT_NEAR(piece.mass_kg(), mass, 1e-12 * mass);
  EXPECT_LT((piece.momentum_kg_m_per_s() - mass * velocity).norm(), 1e-6 * mass);
  EXPECT_LT((piece.angular_velocity_rad_per_s() - spin).norm(), 1e-5);
}

TEST(Split, where_nothing_is_fixed_the_largest_stays) {
  Row row(FreeParts::rigid, {0.012, 0.02});
  // Equal numbers of triangles: the search keeps the first; told apart by a third ball that is finer.
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  EXPECT_EQ(split.deltas.size(), 1u);
  EXPECT_TRUE(row.split().parts.empty()) << "once";
}

TEST(Split, the_fixed_one_stays_and_the_other_leaves_whichever_is_smaller) {
  for (const std::vector<double>& radii : {std::vector{0.02, 0.012}, std::vector{0.012, 0.02}}) {
    Row row(FreeParts::rigid, radii, 0);
    const Split split = row.split();
    ASSERT_EQ(split.parts.size(), 1u);
    EXPECT_TRUE(split.parts[0]->rigid);
    EXPECT_GT(split.parts[0]->mesh.rest_body_m(0).x(), 0.05);
    const SurfaceReport rest = check(row.body->mesh);
    EXPECT_TRUE(rest.valid());
    EXPECT_EQ(rest.components, 1u);
  }
}

TEST(Split, the_larger_side_leaves_when_the_smaller_is_fixed) {
  Row row(FreeParts::rigid);
  row.spec.mesh = {};
  TriangleSoup& soup = row.spec.mesh;
  soup = ellipsoid(1, Vec3::Constant(0.02));
  const auto first = static_cast<VertexId>(soup.vertices_body_m.size());
  const TriangleSoup large = moved(ellipsoid(3, Vec3::Constant(0.02)), Vec3(0.1, 0, 0));
  soup.vertices_body_m.insert(soup.vertices_body_m.end(), large.vertices_body_m.begin(), large.vertices_body_m.end());
  for (const auto& t : large.triangles) soup.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  row.spec.fixed = Box{Vec3(-1, -1, -1), Vec3(0, 1, 1)};
  row.body = std::make_unique<Body>(row.spec, row.scene, 0, surface_spring_engines);
  row.body->unsettled = {0, row.body->mesh.triangle_slots() - 1};
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  EXPECT_EQ(split.parts[0]->mesh.triangle_count(), 1280u);
  EXPECT_EQ(row.body->mesh.triangle_count(), 80u);
}

TEST(Split, a_part_that_is_anchored_itself_deforms_on_as_a_body) {
  Row row(FreeParts::rigid, {0.02, 0.012}, 0.1);  // reaches into both
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  EXPECT_FALSE(split.parts[0]->rigid);
  EXPECT_TRUE(anchored(*split.parts[0]));
}

TEST(Split, fragments_below_the_stated_size_are_removed) {
  Row row(FreeParts::rigid, {0.02, 0.012, 0.006});
  row.spec.splitting.least_volume_m3 = 2e-6;
  const double before = check(row.body->mesh).volume_m3;
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  ASSERT_EQ(split.removed_m3.size(), 1u);
  EXPECT_NEAR(check(row.body->mesh).volume_m3 + check(split.parts[0]->mesh).volume_m3 + split.removed_m3[0], before,
              1e-12 * before);
}

TEST(Split, a_part_that_goes_on_deforming_falls_and_rests_on_the_floor) {
  Row row(FreeParts::deformable, {0.02, 0.012}, 0);
  row.scene.floor_z_m = -0.06;
  std::vector<std::unique_ptr<Body>> bodies;
  Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  bodies.push_back(std::move(row.body));
  bodies.push_back(std::move(split.parts[0]));
  Body& part = *bodies[1];
  const auto extent_z = [&] {
    Box3 box;
    for (const Vec3f& p : part.positions_world_m()) box.extend(p.cast<double>());
    return std::pair(box.min().z(), box.sizes().z());
  };
  for (int i = 0; i < 60; ++i) part.deform({}, {}, row.scene.step_s);
  const double damping = row.spec.material.damping_per_s, t = 0.06;
  const double fallen_m = 9.81 / damping * (t - (1 - std::exp(-damping * t)) / damping);
  EXPECT_NEAR(extent_z().first, -0.012 - fallen_m, 1.5e-3);
  double before_m = 1;
  int still = 0;
  for (int i = 0; i < 4000 && still < 200; ++i) {
    for (auto& body : bodies) body->deform({}, {}, row.scene.step_s);
    step_rigid_pieces(bodies, {}, row.scene, {});
    const double middle_m = part.frame_world(0).position_m.z();
    still = std::abs(middle_m - std::exchange(before_m, middle_m)) < 1e-7 ? still + 1 : 0;
  }
  EXPECT_EQ(still, 200);
  EXPECT_NEAR(extent_z().first, -0.06, 1e-5);
  EXPECT_LT(extent_z().second, 0.024) << "it is what it was, a little flatter";
  EXPECT_GT(extent_z().second, 0.02);
}

TEST(Split, a_part_that_goes_on_deforming_lies_on_other_tissue) {
  Row row(FreeParts::deformable, {0.02, 0.012}, 0);
  Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  BodySpec bed_spec;
  bed_spec.name = "bed";
  bed_spec.mesh = moved(box(16, 16, 2, Vec3(0.12, 0.12, 0.02)), Vec3(0.04, -0.06, -0.04));
  bed_spec.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -0.035)};
  std::vector<std::unique_ptr<Body>> bodies;
  bodies.push_back(std::make_unique<Body>(bed_spec, row.scene, 0, surface_spring_engines));
  bodies.push_back(std::move(split.parts[0]));
  double lowest_m = 0;
  for (int i = 0; i < 1500; ++i) {
    for (auto& body : bodies) body->deform({}, {}, row.scene.step_s);
    step_rigid_pieces(bodies, {}, row.scene, {});
    lowest_m = std::min(lowest_m, bodies[1]->frame_world(0).position_m.z());
  }
  EXPECT_GT(lowest_m, -0.016) << "it dents the bed and gives way itself, but doesn't go through";
  EXPECT_NEAR(bodies[1]->frame_world(0).position_m.z(), -0.02 + 0.012, 5e-3) << "it stays there";
}

TEST(Split, without_room_parts_stay_where_they_are) {
  Row row(FreeParts::rigid, {0.02, 0.012, 0.012});
  EXPECT_EQ(row.split(1).parts.size(), 1u);
  EXPECT_EQ(check(row.body->mesh).components, 2u);
}

// A part set down on a body that is fixed.
TEST(RigidPieces, one_rests_on_a_deformable_body_and_on_another_and_sleeps_until_it_is_stirred) {
  Scene scene;
  BodySpec table_spec;
  table_spec.name = "table";
  table_spec.mesh = box(8, 8, 1, Vec3(0.1, 0.1, 0.01));
  table_spec.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  BodySpec block_spec;
  block_spec.name = "block";
  block_spec.material.damping_per_s = 0;
  block_spec.splitting.free_parts = FreeParts::rigid;
  std::vector<std::unique_ptr<Body>> bodies;
  bodies.push_back(std::make_unique<Body>(table_spec, scene, 0, surface_spring_engines));
  for (std::uint32_t i = 1; i <= 2; ++i) {
    const TriangleMesh block(box(3, 3, 2, Vec3(0.03, 0.03, 0.02)));
    bodies.push_back(std::make_unique<Body>(block_spec, scene, i, surface_spring_engines, block,
                                            particles_at_rest(block.rest_body_m(), {}), Pose{}));
    for (auto& x : bodies.back()->particles.position_world_m)
      x.head<3>() += Vec3f(0.035f, 0.035f, 0.012f + 0.025f * float(i - 1));
    ASSERT_TRUE(bodies.back()->become_rigid());
  }
  const std::vector<std::uint8_t> calm(3, 0), stirred{1, 0, 0};
  int steps = 0;
  for (; steps < 3000 && !(bodies[1]->rigid->body.asleep() && bodies[2]->rigid->body.asleep()); ++steps)
    step_rigid_pieces(bodies, {{}, {}, calm}, scene, {});
  EXPECT_LT(steps, 3000);
  EXPECT_NEAR(bodies[1]->rigid->body.pose_world().position_m.z(), 0.02, 3e-4);
  EXPECT_NEAR(bodies[2]->rigid->body.pose_world().position_m.z(), 0.04, 5e-4);
  step_rigid_pieces(bodies, {{}, {}, stirred}, scene, {});
  EXPECT_FALSE(bodies[1]->rigid->body.asleep());
  EXPECT_TRUE(bodies[2]->rigid->body.asleep()) << "it doesn't touch the table";
}

// A block over a slab of tissue 20 mm thick that is held from below.
struct BlockOverBed {
  explicit BlockOverBed(const Vec3& gravity_m_per_s2 = Vec3(0, 0, -9.81), double friction = 0.4) {
    scene.gravity_m_per_s2 = gravity_m_per_s2;
    bed_spec.name = "bed";
    bed_spec.mesh = box(16, 16, 2, Vec3(0.12, 0.12, 0.02));
    bed_spec.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.005)};
    block_spec.name = "block";
    block_spec.splitting.friction = friction;
    bodies.push_back(std::make_unique<Body>(bed_spec, scene, 0, surface_spring_engines));
    const TriangleMesh block(moved(box(3, 3, 2, Vec3(0.03, 0.03, 0.02)), Vec3(0.043, 0.042, 0.021)));
    bodies.push_back(std::make_unique<Body>(block_spec, scene, 1, surface_spring_engines, block,
                                            particles_at_rest(block.rest_body_m(), {}), Pose{}));
    EXPECT_TRUE(bodies[1]->become_rigid());
    for (int i = 0; i < 500; ++i) bodies[0]->deform({}, {}, scene.step_s);  // the bed sags by itself
  }

  void step() {
    bodies[0]->deform({}, {}, scene.step_s);
    step_rigid_pieces(bodies, {{}, {}, calm}, scene, {});
  }
  const SurfaceSprings& springs() const { return dynamic_cast<const SurfaceSprings&>(*bodies[0]->engines.deformation); }
  RigidBody& block() { return bodies[1]->rigid->body; }
  double energy_j() const {
    const RigidBody& b = bodies[1]->rigid->body;
    const ParticleState& p = bodies[0]->particles;
    return springs().energy_j(p.position_world_m, p.velocity_world_m_per_s) + b.kinetic_energy_j() -
           b.mass_kg() * scene.gravity_m_per_s2.dot(b.pose_world().position_m);
  }
  // How far the bed's top is pressed down under the middle of the block.
  double dent_m() {
    const Vec3 above = block().pose_world().position_m + Vec3(0, 0, 0.05);
    const auto hit = bodies[0]->tree().first_hit(bodies[0]->view(), above, above - Vec3(0, 0, 0.1));
    return 0.02 - hit.value().point_world_m.z();
  }

  Scene scene;
  BodySpec bed_spec, block_spec;
  std::vector<std::uint8_t> calm{0, 0};
  std::vector<std::unique_ptr<Body>> bodies;
};

TEST(RigidPieces, dropped_on_tissue_one_dents_it_comes_to_rest_and_bears_on_it_asleep_and_energy_only_falls) {
  BlockOverBed world;
  world.block().set_velocity(Vec3(0.05, 0, 0), Vec3(0, 3, 0));
  const double unloaded_m = world.dent_m();
  double least_j = world.energy_j();
  int steps = 0;
  for (; steps < 3000 && !world.block().asleep(); ++steps) {
    world.step();
    const double energy_j = world.energy_j();
    // The bed's own step errs by a share of what swings; the block fell with 0.4 mJ.
    EXPECT_LT(energy_j, least_j + 4e-6) << steps;
    least_j = std::min(least_j, energy_j);
  }
  EXPECT_LT(steps, 1500);
  const double loaded_m = world.dent_m();
  EXPECT_GT(loaded_m, unloaded_m + 1e-4) << "its weight is felt";
  const Vec3 at = world.block().pose_world().position_m;
  for (int i = 0; i < 1000; ++i) world.step();
  EXPECT_EQ(at, world.block().pose_world().position_m);
  EXPECT_NEAR(world.dent_m(), loaded_m, 2e-5) << "also while it sleeps";
}

TEST(RigidPieces, a_bed_sleeps_under_one_that_sleeps_bears_another_and_wakes_when_one_is_lifted_or_falls_on_it) {
  for (const bool falls : {false, true}) {
    BlockOverBed world;
    Body& bed = *world.bodies[0];
    for (int i = 0; i < 6000 && !(bed.asleep() && world.block().asleep()); ++i) {
      if (bed.asleep())
        step_rigid_pieces(world.bodies, {{}, {}, world.calm}, world.scene, {});
      else
        world.step(), bed.watch_rest(world.scene);
    }
    ASSERT_TRUE(bed.asleep() && world.block().asleep());
    const auto before = bed.particles.position_world_m;
    for (int i = 0; i < 100; ++i) step_rigid_pieces(world.bodies, {{}, {}, world.calm}, world.scene, {});
    EXPECT_EQ(before, bed.particles.position_world_m) << "it bears the block, and nothing moves";
    if (falls) {
      world.block().wake();
      world.block().set_velocity(Vec3(0, 0, -0.1), Vec3::Zero());
      step_rigid_pieces(world.bodies, {{}, {}, world.calm}, world.scene, {});
    } else {
      step_rigid_pieces(world.bodies, {{}, {}, std::vector<std::uint8_t>{0, 1}}, world.scene, {});
    }
    EXPECT_FALSE(bed.asleep());
    for (int i = 0; i < 3000 && !world.block().asleep(); ++i) world.step();
    EXPECT_TRUE(world.block().asleep()) << "it comes to rest again";
  }
}

TEST(RigidPieces, contact_with_tissue_keeps_momentum) {
  BlockOverBed world(Vec3::Zero());
  world.block().set_velocity(Vec3(0.05, 0.02, -0.3), Vec3(1, 3, 0));
  Body& bed = *world.bodies[0];
  bool met = false;
  for (int i = 0; i < 30; ++i) {
    bed.deform({}, {}, world.scene.step_s);
    const auto momentum = [&] {
      Vec3 sum = world.block().momentum_kg_m_per_s();
      for (VertexId v = 0; v < bed.mesh.vertex_slots(); ++v)
        if (!world.springs().fixed(v)) sum += bed.particle_view().velocity(v) / world.springs().inverse_mass_per_kg(v);
      return sum;
    };
    const Vec3 before = momentum(), of_block = world.block().momentum_kg_m_per_s();
    step_rigid_pieces(world.bodies, {{}, {}, world.calm}, world.scene, {});
    met |= (world.block().momentum_kg_m_per_s() - of_block).norm() > 1e-4;
    EXPECT_LT((momentum() - before).norm(), 1e-6 * before.norm()) << "floats in particles";
  }
  EXPECT_TRUE(met);
}

TEST(RigidPieces, on_a_slope_of_tissue_one_slides_by_friction_or_sticks_and_sleeps) {
  // 30 degrees: tan = 0.58. The dent goes along with the piece, which takes some of its speed.
  const double g = 9.81, sine = 0.5, cosine = std::sqrt(0.75);
  const auto speed_after_120_steps = [&](BlockOverBed& world) {
    for (int i = 0; i < 120; ++i) world.step();
    return world.block().velocity_m_per_s().x();
  };
  for (const double friction : {0.0, 0.2}) {
    BlockOverBed world(Vec3(g * sine, 0, -g * cosine), friction);
    const double free_m_per_s = 0.12 * g * (sine - friction * cosine), speed = speed_after_120_steps(world);
    EXPECT_LT(speed, free_m_per_s);
    EXPECT_GT(speed, 0.6 * free_m_per_s);
  }
  BlockOverBed world(Vec3(g * sine, 0, -g * cosine), 0.9);
  EXPECT_LT(speed_after_120_steps(world), 0.05);
  int steps = 0;
  for (; steps < 2000 && !world.block().asleep(); ++steps) world.step();
  EXPECT_LT(steps, 2000);
  EXPECT_LT(world.block().pose_world().position_m.x(), 0.058 + 0.008);
}

// Three points of the block, held where they are and then taken along.
struct Held {
  explicit Held(BlockOverBed& w, double force_n = 1) : world(w) {
    for (const Vec3& p : {Vec3(0.01, 0, 0), Vec3(0, 0.01, 0), Vec3(-0.01, 0, 0.01)}) {
      arms_m.push_back(p);
      grips.push_back({1, Vec3::Zero(), world.block().pose_world().to_world(p), force_n});
    }
  }
  // Returns the work of the instrument.
  double step(const Vec3& by_m) {
    double work_j = 0;
    for (std::size_t i = 0; i < grips.size(); ++i) {
      grips[i].point_world_m = world.block().pose_world().to_world(arms_m[i]);
      grips[i].to_world_m += by_m;
    }
    std::vector<Reaction> reactions(grips.size());
    world.bodies[0]->deform({}, {}, world.scene.step_s);
    step_rigid_pieces(world.bodies, {{}, grips, world.calm}, world.scene, reactions);
    for (const Reaction& r : reactions) work_j -= r.force_on_tool_n.dot(by_m);
    return work_j;
  }
  BlockOverBed& world;
  std::vector<Vec3> arms_m;
  std::vector<GraspConstraint> grips;
};

TEST(RigidPieces, lifted_with_jaws_energy_rises_by_no_more_than_their_work) {
  BlockOverBed world;
  for (int i = 0; i < 600; ++i) world.step();
  Held held(world);
  const double start_j = world.energy_j(), height_m = world.block().pose_world().position_m.z();
  double work_j = 0;
  for (int i = 0; i < 400; ++i) {
    work_j += held.step(Vec3(2e-5, 0, i < 40 ? 0 : 5e-5));
    EXPECT_LT(world.energy_j() - start_j, work_j + 2e-5) << i;
  }
  const double lifted_m = world.block().pose_world().position_m.z() - height_m;
  EXPECT_NEAR(lifted_m, 360 * 5e-5, 5e-4);
  EXPECT_GT(work_j, world.block().mass_kg() * 9.81 * lifted_m) << "and the bed's";
  EXPECT_GT((world.block().pose_world().orientation * Vec3::UnitZ()).z(), 0.999) << "it doesn't swing";
}

TEST(RigidPieces, jaws_pull_with_no_more_than_their_force) {
  BlockOverBed world;
  for (int i = 0; i < 600; ++i) world.step();
  const double height_m = world.block().pose_world().position_m.z(), weight_n = world.block().mass_kg() * 9.81;
  Held held(world, 0.2 * weight_n);
  for (int i = 0; i < 200; ++i) held.step(Vec3(0, 0, 5e-5));
  EXPECT_NEAR(world.block().pose_world().position_m.z(), height_m, 1e-3) << "three of them are not enough";
}

TEST(RigidPieces, an_instrument_pushes_one_and_feels_it) {
  Scene scene;
  scene.gravity_m_per_s2.setZero();
  BodySpec spec;
  spec.splitting.free_parts = FreeParts::rigid;
  const TriangleMesh block(box(3, 3, 2, Vec3(0.03, 0.03, 0.02)));
  std::vector<std::unique_ptr<Body>> bodies;
  bodies.push_back(std::make_unique<Body>(spec, scene, 0, surface_spring_engines, block,
                                          particles_at_rest(block.rest_body_m(), {}), Pose{}));
  ASSERT_TRUE(bodies[0]->become_rigid());
  RigidTouch touch;
  touch.constraint.v = block.triangle(0).v;
  touch.constraint.w = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  touch.constraint.unilateral = true;
  const auto& c = block.triangle(0).v;
  const Vec3 a = block.rest_body_m(c[0]), b = block.rest_body_m(c[1]), d = block.rest_body_m(c[2]);
  touch.constraint.normal = (b - a).cross(d - a).normalized();
  touch.constraint.target_world_m = (a + b + d) / 3 - 1e-3 * touch.constraint.normal;
  touch.tool_velocity_m_per_s = -0.05 * touch.constraint.normal;
  std::vector<Reaction> reactions(1);
  const std::vector<std::uint8_t> calm(1, 0);
  const std::vector touches{touch};
  step_rigid_pieces(bodies, {touches, {}, calm}, scene, reactions);
  EXPECT_TRUE(reactions[0].active);
  const RigidBody& piece = bodies[0]->rigid->body;
  EXPECT_GT(-piece.velocity_m_per_s().dot(touch.constraint.normal), 0.01) << "away from the instrument";
  EXPECT_LT((reactions[0].force_on_tool_n * scene.step_s + piece.momentum_kg_m_per_s()).norm(), 1e-9)
      << "action and reaction";
}

}  // namespace
}  // namespace sectio::test
