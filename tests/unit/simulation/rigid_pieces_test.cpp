#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/step/collide.h"
#include "sim_server/surface/surface_engines.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

// A step of bodies without instruments.
void step_all(std::span<const std::unique_ptr<Body>> bodies, const Scene& scene,
              std::span<const std::uint8_t> disturbed = {}) {
  for (const auto& body : bodies) body->deform({}, {}, scene.step_s);
  collide_bodies(bodies, disturbed, scene);
}

// A part set down on a body that is fixed.
TEST(RigidPieces, one_rests_on_a_deformable_body_and_on_another_and_sleeps_until_it_is_disturbed) {
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
    const Pose above{Vec3(0.035, 0.035, 0.012 + 0.025 * (i - 1)), Eigen::Quaterniond::Identity()};
    bodies.push_back(std::make_unique<Body>(block_spec, scene, i, surface_spring_engines, block,
                                            particles_at_rest(block.rest_body_m(), above), above));
    ASSERT_NE(bodies.back()->rigid(), nullptr);
  }
  const std::vector<std::uint8_t> disturbed{1, 0, 0};
  int steps = 0;
  for (; steps < 3000 && !(bodies[1]->rigid()->body.asleep() && bodies[2]->rigid()->body.asleep()); ++steps)
    step_all(bodies, scene);
  EXPECT_LT(steps, 3000);
  EXPECT_NEAR(bodies[1]->rigid()->body.pose_world().position_m.z(), 0.02, 3e-4);
  EXPECT_NEAR(bodies[2]->rigid()->body.pose_world().position_m.z(), 0.04, 5e-4);
  step_all(bodies, scene, disturbed);
  EXPECT_FALSE(bodies[1]->rigid()->body.asleep());
  EXPECT_TRUE(bodies[2]->rigid()->body.asleep()) << "it doesn't touch the table";
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
    block_spec.splitting.free_parts = FreeParts::rigid;
    bodies.push_back(std::make_unique<Body>(bed_spec, scene, 0, surface_spring_engines));
    const TriangleMesh block(moved(box(3, 3, 2, Vec3(0.03, 0.03, 0.02)), Vec3(0.043, 0.042, 0.021)));
    bodies.push_back(std::make_unique<Body>(block_spec, scene, 1, surface_spring_engines, block,
                                            particles_at_rest(block.rest_body_m(), {}), Pose{}));
    for (int i = 0; i < 500; ++i) bodies[0]->deform({}, {}, scene.step_s);  // the bed sags by itself
  }

  void step(std::span<const std::uint8_t> disturbed = {}) { step_all(bodies, scene, disturbed); }
  const SurfaceSprings& springs() const { return dynamic_cast<const SurfaceSprings&>(*bodies[0]->engines.deformation); }
  RigidBody& block() { return bodies[1]->rigid()->body; }
  double energy_j() const {
    const RigidBody& b = bodies[1]->rigid()->body;
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
      world.step();
      bed.watch_rest(world.scene);
    }
    ASSERT_TRUE(bed.asleep() && world.block().asleep());
    const auto before = bed.particles.position_world_m;
    for (int i = 0; i < 100; ++i) world.step();
    EXPECT_EQ(before, bed.particles.position_world_m) << "it bears the block, and nothing moves";
    if (falls) {
      world.block().wake();
      world.block().set_velocity(Vec3(0, 0, -0.1), Vec3::Zero());
      world.step();
    } else {
      world.step(std::vector<std::uint8_t>{0, 1});
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
    for (const auto& body : world.bodies) body->deform({}, {}, world.scene.step_s);
    const auto momentum = [&] {
      Vec3 sum = world.block().momentum_kg_m_per_s();
      for (VertexId v = 0; v < bed.mesh.vertex_slots(); ++v)
        if (!world.springs().fixed(v)) sum += bed.particle_view().velocity(v) / world.springs().inverse_mass_per_kg(v);
      return sum;
    };
    const Vec3 before = momentum(), of_block = world.block().momentum_kg_m_per_s();
    collide_bodies(world.bodies, {}, world.scene);
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

// A bed whose time stands still can't push back, and was pushed down by what lay on it, by millimetres.
TEST(RigidPieces, one_stays_where_it_lies_while_its_bed_is_spared) {
  BlockOverBed world;
  for (int i = 0; i < 600; ++i) world.step();
  const double height_m = world.block().pose_world().position_m.z();
  const auto was = world.bodies[0]->particles.position_world_m;
  world.bodies[0]->spared = true;
  for (int i = 0; i < 400; ++i) {
    world.bodies[1]->deform({}, {}, world.scene.step_s);
    collide_bodies(world.bodies, {}, world.scene);
  }
  EXPECT_NEAR(world.block().pose_world().position_m.z(), height_m, 2e-4);
  EXPECT_EQ(world.bodies[0]->particles.position_world_m, was);
  world.bodies[0]->spared = false;
  for (int i = 0; i < 200; ++i) world.step();
  EXPECT_NEAR(world.block().pose_world().position_m.z(), height_m, 2e-4);
}

// Three points of the block, held where they are and then taken along.
struct Held {
  explicit Held(BlockOverBed& w, double force_n = 1) : world(w) {
    for (const Vec3& p : {Vec3(0.01, 0, 0), Vec3(0, 0.01, 0), Vec3(-0.01, 0, 0.01)}) {
      arms_m.push_back(p);
      grips.push_back(hold(kNone, world.block().pose_world().to_world(p)));
      grips.back().largest_force_n = force_n;
    }
  }
  // Returns the work of the instrument.
  double step(const Vec3& by_m) {
    double work_j = 0;
    for (std::size_t i = 0; i < grips.size(); ++i) {
      grips[i].point_world_m = world.block().pose_world().to_world(arms_m[i]);
      grips[i].target_world_m += by_m;
    }
    world.bodies[0]->deform({}, {}, world.scene.step_s);
    world.bodies[1]->deform(grips, {}, world.scene.step_s);
    collide_bodies(world.bodies, {}, world.scene);
    for (const Reaction& r : world.bodies[1]->rigid()->reactions()) work_j -= r.force_on_tool_n.dot(by_m);
    return work_j;
  }
  BlockOverBed& world;
  std::vector<Vec3> arms_m;
  std::vector<PointConstraint> grips;
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
  ASSERT_NE(bodies[0]->rigid(), nullptr);
  PointConstraint touch;
  touch.v = block.triangle(0).v;
  touch.w = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  touch.unilateral = true;
  const auto& c = block.triangle(0).v;
  const Vec3 a = block.rest_body_m(c[0]), b = block.rest_body_m(c[1]), d = block.rest_body_m(c[2]);
  touch.normal = (b - a).cross(d - a).normalized();
  touch.target_world_m = (a + b + d) / 3 - 1e-3 * touch.normal;
  touch.target_velocity_m_per_s = -0.05 * touch.normal;
  bodies[0]->deform({&touch, 1}, {}, scene.step_s);
  collide_bodies(bodies, {}, scene);
  const Reaction& reaction = bodies[0]->rigid()->reactions()[0];
  EXPECT_TRUE(reaction.active);
  const RigidBody& body = bodies[0]->rigid()->body;
  EXPECT_GT(-body.velocity_m_per_s().dot(touch.normal), 0.01) << "away from the instrument";
  EXPECT_LT((reaction.force_on_tool_n * scene.step_s + body.momentum_kg_m_per_s()).norm(), 1e-9)
      << "action and reaction";
}

}  // namespace
}  // namespace sectio::test
