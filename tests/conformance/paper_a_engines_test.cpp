// Paper A, section 2 and conclusion: engines are added and exchanged without touching another. Each of these lives in
// tests/support/own_engines.h.
#include <gtest/gtest.h>

#include "common/core/error.h"
#include "common/mesh/check.h"

#include "sim_server/engine/standard_engines.h"
#include "sim_server/surface/surface_engines.h"
#include "tests/support/loop_cut.h"
#include "tests/support/own_engines.h"

namespace sectio::test {
namespace {

// A loop that frees a part of the first of two organs; the second one only lies there.
Scene two_organs() {
  Scene scene = loop_scene(FreeParts::rigid);
  BodySpec second = scene.bodies[0];
  second.name = "second";
  second.mesh = ellipsoid(3, Vec3(0.06, 0.06, kOrganTop_m));
  second.pose.position_m = Vec3(0.3, 0, 0);
  scene.bodies.push_back(second);
  return scene;
}

void cut_loop(Operation& op) {
  cut_arc(op, 0, 375);
  lift(op);
}

EngineTable with(std::function<void(const EngineSite&, BodyEngines&)> change) {
  EngineTable table = standard_engines();
  table.model("surface_springs").make = [change](const EngineSite& site) {
    BodyEngines engines = surface_spring_engines(site);
    change(site, engines);
    return engines;
  };
  return table;
}

bool same_bits(const Operation& a, const Operation& b, std::uint32_t body) {
  const auto p = a.simulation.positions_world_m(body), q = b.simulation.positions_world_m(body);
  return a.mesh(body).hash() == b.mesh(body).hash() && p.size() == q.size() &&
         std::equal(p.begin(), p.end(), q.begin(), [](const Vec3f& x, const Vec3f& y) { return x == y; });
}

TEST(A_ARCH, A_ARCH_9_an_engine_with_its_own_structures_is_added_and_follows_a_cut_and_a_split) {
  std::vector<const Bleeding*> bleeding;  // by body
  const EngineTable table = with([&](const EngineSite& site, BodyEngines& engines) {
    std::unique_ptr<Bleeding> own;
    if (site.parent)
      own = std::make_unique<Bleeding>(site.body, dynamic_cast<const Bleeding&>(*site.parent->processes.at(0)),
                                       site.vertex_from);
    else
      own = std::make_unique<Bleeding>(site.body);
    bleeding.resize(std::max<std::size_t>(bleeding.size(), site.body.id + 1));
    bleeding[site.body.id] = own.get();
    engines.processes.push_back(std::move(own));
  });
  Operation op(two_organs(), table);
  cut_loop(op);
  ASSERT_EQ(op.simulation.body_count(), 3u);
  ASSERT_EQ(bleeding.size(), 3u);

  double blood_ml = 0, bled_ml = 0, lost_ml = 0;
  for (std::uint32_t b = 0; b < 3; ++b) {
    EXPECT_EQ(bleeding[b]->vessels(), neighbours_of(op.mesh(b))) << "body " << b;
    ASSERT_EQ(bleeding[b]->blood_ml().size(), op.mesh(b).vertex_slots());
    for (const double ml : bleeding[b]->blood_ml()) blood_ml += ml;
    bled_ml += bleeding[b]->bled_ml();
    lost_ml += bleeding[b]->lost_ml();
  }
  EXPECT_GT(bled_ml, 0);
  EXPECT_EQ(bleeding[1]->bled_ml(), 0) << "nobody has cut this one";
  // The blood that the part took along counts here and among its parent's losses.
  double taken_ml = 0;
  for (const double ml : bleeding[2]->blood_ml()) taken_ml += ml;
  EXPECT_GT(taken_ml, 0);
  EXPECT_NEAR(blood_ml + lost_ml, bled_ml + taken_ml - bleeding[2]->bled_ml(), 1e-9 * bled_ml);

  // All that others do is the same, bit for bit.
  Operation without(two_organs());
  cut_loop(without);
  ASSERT_EQ(without.simulation.body_count(), 3u);
  for (std::uint32_t b = 0; b < 3; ++b) EXPECT_TRUE(same_bits(op, without, b)) << "body " << b;
  EXPECT_EQ(op.deltas, without.deltas);
}

TEST(A_ARCH, A_ARCH_10_another_integrator_changes_only_its_own_outputs) {
  const Verlet* verlet = nullptr;
  EngineTable table = standard_engines();
  table.models.push_back({{.name = "verlet", .meaning = "Another integrator."}, [&](const EngineSite& site) {
                            BodyEngines engines = surface_spring_engines(site);
                            auto own =
                                std::make_unique<Verlet>(site.body, site.frame_world, site.spec, site.scene.step_s);
                            if (!site.is_part) verlet = own.get();
                            engines.deformation = std::move(own);
                            return engines;
                          }});
  Scene scene = two_organs();
  scene.bodies[0].model = "verlet";
  Operation op(scene, table), standard(two_organs());
  cut_loop(op);
  cut_loop(standard);

  // The others work on what it does as on any other: the loop is cut and closed, and its inside comes off.
  ASSERT_EQ(op.simulation.body_count(), 3u);
  for (std::uint32_t b = 0; b < 3; ++b) {
    const SurfaceReport report = check(op.mesh(b));
    EXPECT_TRUE(report.valid()) << report.first_defect;
    EXPECT_EQ(report.components, 1u);
  }
  EXPECT_NE(op.simulation.rigid_body(2), nullptr);
  EXPECT_EQ(verlet->steps(), op.last.step);
  EXPECT_EQ(op.count(EventKind::island_freed), standard.count(EventKind::island_freed));
  // Its own body moves in another way; the one that has the standard engines is the same bit for bit.
  EXPECT_FALSE(same_bits(op, standard, 0));
  EXPECT_TRUE(same_bits(op, standard, 1));
}

TEST(A_ARCH, A_ARCH_10_another_search_for_collisions_gives_the_same_cut) {
  const EngineTable table = with([](const EngineSite& site, BodyEngines& engines) {
    engines.collision =
        std::make_unique<EveryTriangle>(SurfaceView{site.body.mesh, site.body.positions_world_m(), site.body.id});
  });
  Operation op(organ_scene(), table), standard(organ_scene());
  for (Operation* each : {&op, &standard}) {
    each->tip_to(-0.02, 0, -0.005, 0.05);
    each->tip_to(-0.02, 0, 0.004, 0.05);
    each->tip_to(0.01, 0, 0.004, 0.05);
    each->move(each->hand().position_m + Vec3(0, 0, 0.02), 0.1);
  }
  EXPECT_GT(op.walls(), 20u);
  EXPECT_TRUE(same_bits(op, standard, 0));
}

TEST(A_ARCH, A_ARCH_9_a_model_without_engines_is_refused_by_name) {
  Scene scene = organ_scene();
  scene.bodies[0].model = "clay";
  try {
    Operation op(scene);
    FAIL() << "no engine was missed";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "organ: bodies[0].model: there are no engines for clay");
  }
}

// Planned by sim_server/net/budget.h when a session is behind its clock; never in a run without a clock.
TEST(A_ARCH, A_ARCH_6_reduced_steps_leave_what_nobody_touches_as_it_is_and_go_on_with_the_rest) {
  Scene scene = two_organs();
  scene.sleep.after_s = 0;
  Operation op(scene);
  op.tip_to(0, 0, -0.002);
  op.tip_to(0, 0, 0.002);
  ASSERT_NE(op.state(), ContactState::free);
  const auto second_before = op.simulation.positions_world_m(1);
  const std::vector<Vec3f> second(second_before.begin(), second_before.end());
  const auto first_before = op.simulation.positions_world_m(0);
  const std::vector<Vec3f> first(first_before.begin(), first_before.end());
  StepInput spare;
  spare.spare_idle_bodies = true;
  spare.overrun = "reduced: 80 ms behind";
  op.step(spare);
  EXPECT_EQ(op.count(EventKind::step_overrun), 1u);
  const auto same = [](const std::vector<Vec3f>& before, PositionsView now) {
    return std::equal(before.begin(), before.end(), now.begin(), now.end());
  };
  EXPECT_TRUE(same(second, op.simulation.positions_world_m(1)));
  EXPECT_FALSE(same(first, op.simulation.positions_world_m(0)));
  op.rest(1);
  EXPECT_FALSE(same(second, op.simulation.positions_world_m(1))) << "it goes on from there";
  EXPECT_EQ(op.count(EventKind::step_overrun), 1u);
}

}  // namespace
}  // namespace sectio::test
