#include "sim_server/step/step.h"
#include "sim_server/surface/surface_engines.h"

#include <gtest/gtest.h>

#include <numeric>

#include "common/mesh/check.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/step/collide.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

// The result of the stage of splitting for a body.
struct Split {
  std::vector<TopologyDelta> deltas;
  std::vector<Body*> parts;
  double removed_m3 = 0;
};

// The world with one body that nothing has looked at yet.
struct Uncut {
  explicit Uncut(const BodySpec& spec) : world(std::make_unique<SimulatedWorld>(scene_of(spec), standard_engines())) {
    body().unsettled.resize(body().mesh.triangle_slots());
    std::iota(body().unsettled.begin(), body().unsettled.end(), TriangleId{0});
  }
  static Scene scene_of(const BodySpec& spec) {
    Scene scene;
    scene.file = "row";
    scene.bodies.push_back(spec);
    return scene;
  }

  Body& body() { return *world->bodies[0]; }
  Scene& scene() { return world->scene; }
  Split split() {
    StepOutput output;
    StepContext context(StepInput{}, output, world->bodies.size(), nullptr);
    const std::size_t before = world->bodies.size();
    sectio::split(*world, context);
    Split result;
    for (BodyDelta& d : output.deltas) result.deltas.push_back(std::move(d.delta));
    for (std::size_t b = before; b < world->bodies.size(); ++b) result.parts.push_back(world->bodies[b].get());
    result.removed_m3 = output.report.removed_volume_m3;
    return result;
  }

  std::unique_ptr<SimulatedWorld> world;
};

// Balls of 20 mm and of other sizes side by side, as one body.
BodySpec row_of_balls(FreeParts free_parts, const std::vector<double>& radii_m, double fixed_below_x_m) {
  BodySpec spec;
  spec.name = "row";
  spec.splitting.free_parts = free_parts;
  double x_m = 0;
  for (const double r : radii_m) {
    const TriangleSoup ball = moved(ellipsoid(2, Vec3::Constant(r)), Vec3(x_m, 0, 0));
    spec.mesh = joined(std::move(spec.mesh), ball);
    x_m += 0.1;
  }
  if (fixed_below_x_m > -1) spec.fixed = Box{Vec3(-1, -1, -1), Vec3(fixed_below_x_m, 1, 1)};
  return spec;
}

struct Row : Uncut {
  explicit Row(FreeParts free_parts, const std::vector<double>& radii_m = {0.02, 0.012}, double fixed_below_x_m = -1)
      : Uncut(row_of_balls(free_parts, radii_m, fixed_below_x_m)) {}
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
  const auto* springs = dynamic_cast<const SurfaceSprings*>(body.engines.deformation.get());
  return springs && springs->anchored(0);
}
void disturb(Body& body) {
  std::srand(3);
  for (auto& v : body.particles.velocity_world_m_per_s) v.head<3>() = Vec3f::Random();
  for (auto& x : body.particles.position_world_m) x.head<3>() += 1e-3f * Vec3f::Random();
}

class Policies : public testing::TestWithParam<FreeParts> {};
TEST_P(Policies, volume_and_both_momenta_are_kept) {
  Row row(GetParam(), {0.02, 0.012, 0.016});
  disturb(row.body());
  Momenta before, after;
  add(row.body(), before);
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 2u);
  add(row.body(), after);
  for (const auto& part : split.parts) add(*part, after);
  EXPECT_NEAR(after.volume_m3, before.volume_m3, 1e-12 * before.volume_m3);
  // Rigid velocities are stored as floats again, one rounding a vertex.
  EXPECT_LT((after.linear - before.linear).norm(), 1e-6 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-6 * before.angular.norm());
  EXPECT_GT(before.linear.norm() * before.angular.norm(), 0);
  for (const auto& part : split.parts) {
    EXPECT_EQ(part->rigid() != nullptr, GetParam() == FreeParts::rigid);
    EXPECT_FALSE(anchored(*part));
  }
}
INSTANTIATE_TEST_SUITE_P(Free, Policies, testing::Values(FreeParts::rigid, FreeParts::deformable));

TEST(Split, a_rigid_part_weighs_what_it_holds_and_has_the_momentum_of_its_motion) {
  Row row(FreeParts::rigid);
  const Vec3 velocity(0.3, -0.2, 0.1), spin(1, 2, 3);
  for (VertexId v = 0; v < row.body().mesh.vertex_slots(); ++v)
    row.body().particles.velocity_world_m_per_s[v].head<3>() =
        (velocity + spin.cross(row.body().particle_view().position(v) - Vec3(0.1, 0, 0))).cast<float>();
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  const RigidBody& piece = split.parts[0]->rigid()->body;
  const double mass = row.scene().bodies[0].material.density_kg_per_m3 * check(split.parts[0]->mesh).volume_m3;
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
    EXPECT_NE(split.parts[0]->rigid(), nullptr);
    EXPECT_GT(split.parts[0]->mesh.rest_body_m(0).x(), 0.05);
    const SurfaceReport rest = check(row.body().mesh);
    EXPECT_TRUE(rest.valid());
    EXPECT_EQ(rest.components, 1u);
  }
}

TEST(Split, the_larger_side_leaves_when_the_smaller_is_fixed) {
  BodySpec spec = row_of_balls(FreeParts::rigid, {}, 0);
  TriangleSoup& soup = spec.mesh;
  soup = ellipsoid(1, Vec3::Constant(0.02));
  const auto first = static_cast<VertexId>(soup.vertices_body_m.size());
  const TriangleSoup large = moved(ellipsoid(3, Vec3::Constant(0.02)), Vec3(0.1, 0, 0));
  soup.vertices_body_m.insert(soup.vertices_body_m.end(), large.vertices_body_m.begin(), large.vertices_body_m.end());
  for (const auto& t : large.triangles) soup.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  Uncut row(spec);
  row.body().unsettled = {0, row.body().mesh.triangle_slots() - 1};
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  EXPECT_EQ(split.parts[0]->mesh.triangle_count(), 1280u);
  EXPECT_EQ(row.body().mesh.triangle_count(), 80u);
}

TEST(Split, a_part_that_is_anchored_itself_deforms_on_as_a_body) {
  Row row(FreeParts::rigid, {0.02, 0.012}, 0.1);  // reaches into both
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  EXPECT_EQ(split.parts[0]->rigid(), nullptr);
  EXPECT_TRUE(anchored(*split.parts[0]));
}

TEST(Split, fragments_below_the_stated_size_are_removed) {
  Row row(FreeParts::rigid, {0.02, 0.012, 0.006});
  row.scene().bodies[0].splitting.least_volume_m3 = 2e-6;
  const double before = check(row.body().mesh).volume_m3;
  const Split split = row.split();
  ASSERT_EQ(split.parts.size(), 1u);
  EXPECT_GT(split.removed_m3, 0);
  EXPECT_NEAR(check(row.body().mesh).volume_m3 + check(split.parts[0]->mesh).volume_m3 + split.removed_m3, before,
              1e-12 * before);
}

TEST(Split, a_part_that_goes_on_deforming_falls_and_rests_on_the_floor) {
  Row row(FreeParts::deformable, {0.02, 0.012}, 0);
  row.scene().floor_z_m = -0.06;
  ASSERT_EQ(row.split().parts.size(), 1u);
  const auto& bodies = row.world->bodies;
  Body& part = *bodies[1];
  const auto extent_z = [&] {
    Box3 box;
    for (const Vec3f& p : part.positions_world_m()) box.extend(p.cast<double>());
    return std::pair(box.min().z(), box.sizes().z());
  };
  for (int i = 0; i < 60; ++i) part.deform({}, {}, row.scene().step_s);
  const double damping = row.scene().bodies[0].material.damping_per_s, t = 0.06;
  const double fallen_m = 9.81 / damping * (t - (1 - std::exp(-damping * t)) / damping);
  EXPECT_NEAR(extent_z().first, -0.012 - fallen_m, 1.5e-3);
  double before_m = 1;
  int still = 0;
  for (int i = 0; i < 4000 && still < 200; ++i) {
    for (auto& body : bodies) body->deform({}, {}, row.scene().step_s);
    collide_bodies(bodies, {}, row.scene());
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
  ASSERT_EQ(row.split().parts.size(), 1u);
  BodySpec bed_spec;
  bed_spec.name = "bed";
  bed_spec.mesh = moved(box(16, 16, 2, Vec3(0.12, 0.12, 0.02)), Vec3(0.04, -0.06, -0.04));
  bed_spec.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -0.035)};
  const auto& bodies = row.world->bodies;
  row.world->bodies[0] = std::make_unique<Body>(bed_spec, row.scene(), 0, surface_spring_engines);
  double lowest_m = 0;
  for (int i = 0; i < 1500; ++i) {
    const StepInput input;
    StepOutput output;
    StepContext context(input, output, bodies.size(), nullptr);
    meet(*row.world, context);
    deform(*row.world, context);
    collide(*row.world, context);
    lowest_m = std::min(lowest_m, bodies[1]->frame_world(0).position_m.z());
  }
  EXPECT_GT(lowest_m, -0.016) << "it dents the bed and gives way itself, but doesn't go through";
  EXPECT_NEAR(bodies[1]->frame_world(0).position_m.z(), -0.02 + 0.012, 5e-3) << "it stays there";
}

TEST(Split, without_room_parts_stay_where_they_are) {
  Row row(FreeParts::rigid, {0.02, 0.012, 0.012});
  row.world->most_bodies = 2;
  EXPECT_EQ(row.split().parts.size(), 1u);
  EXPECT_EQ(check(row.body().mesh).components, 2u);
}

}  // namespace
}  // namespace sectio::test
