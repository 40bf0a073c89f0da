// Cuts in bodies that are volumes, through the whole simulation (paper C, 3.2).
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "common/delta/keyframe.h"
#include "common/mesh/check.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/volume_deformation.h"
#include "sim_server/simulation.h"
#include "sim_server/volume/tets/collapse.h"
#include "sim_server/volume/volume_cutting.h"
#include "sim_server/volume/volume_engines.h"
#include "sim_server/world/body.h"
#include "tests/support/block_under_blade.h"
#include "tests/support/random.h"

namespace sectio::volume_test {
namespace {

using test::BlockUnderBlade;

class VolumeCuts : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, VolumeCuts, testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(VolumeCuts, C_CUT_6_every_delta_leaves_a_closed_surface_of_the_same_volume_that_a_replica_has_too) {
  BlockUnderBlade block(GetParam());
  const double volume_m3 = block.volume_m3();
  auto replica = mesh_of(keyframe_of(block.body().mesh));
  ASSERT_TRUE(replica);
  int deltas = 0;
  std::uint32_t walls = 0;
  block.go(0.025, 0.02, [&](const CutPlan& plan) {
    ++deltas;
    const auto received = delta_from_bytes(to_bytes(plan.delta));
    ASSERT_TRUE(received);
    ASSERT_EQ(apply(*received, *replica), ApplyStatus::applied);
    EXPECT_TRUE(replica->same_database(block.body().mesh));
    const SurfaceReport surface = check(*replica);
    EXPECT_TRUE(surface.valid()) << surface.first_defect;
    EXPECT_NEAR(surface.volume_m3, volume_m3, 1e-9 * volume_m3);
    const TetReport inside = check(block.cutting().volume().mesh());
    EXPECT_TRUE(inside.conforming) << inside.first_defect;  // in a vertex it may touch itself
    EXPECT_NEAR(inside.volume_m3, volume_m3, 1e-9 * volume_m3);
  });
  for (const Triangle& t : replica->triangles()) walls += t.alive() && t.surface == Surface::wall;
  EXPECT_GT(deltas, 5);
  EXPECT_GT(walls, 40u);
}

TEST_P(VolumeCuts, C_CUT_4_the_body_is_alive_after_a_cut_and_what_was_cut_opens) {
  BlockUnderBlade block(GetParam());
  block.go(0.025, 0.012);
  for (int n = 0; n < 200; ++n) block.body().deform({}, {}, 0.001);
  EXPECT_EQ(block.body().engines.deformation->first_bad_vertex(), kNone);
  EXPECT_LT(block.body().engines.deformation->diagnostics().added_mass_fraction, 0.05);
  for (const Vec3f& x : block.body().positions_world_m()) EXPECT_LT(x.norm(), 0.1f);
  EXPECT_EQ(check(block.body().mesh).components, 1u);
}

// Edges below `ratio` that tidying leaves, counted by the reason against their collapse in the better direction.
std::map<std::string, int> short_edges(const Body& body, const VolumeCutting& cutting, double ratio) {
  const TetTopology& volume = cutting.volume();
  const auto fixed = [&](VertexId v) { return volume.vertex(v).rest_body_m.z() <= 0.004; };
  const auto kind = [&](const Corners3& corners) {
    return static_cast<int>(body.mesh.triangle(cutting.surface().triangle_of(body.mesh, corners)).surface);
  };
  std::map<std::string, int> found;
  for (VertexId v = 0; v < volume.vertex_count(); ++v) {
    std::set<VertexId> around;
    for (const std::uint32_t t : volume.star(v))
      around.insert(volume.tetrahedra()[t].begin(), volume.tetrahedra()[t].end());
    for (const VertexId w : around)
      if (w != v && edge_ratio(volume, v, w) < ratio)
        ++found[fixed(v) ? "fixed" : to_string(judge_collapse(volume, v, w, kind))];
  }
  return found;
}

double worst_quality(const TetTopology& volume) {
  double worst = 1;
  for (std::uint32_t t = 0; t < volume.tetrahedra().size(); ++t)
    if (volume.tetrahedra()[t] != kNoTetrahedron) worst = std::min(worst, shape_quality(volume, t));
  return worst;
}

// Steps that a millisecond takes without added mass.
int parts_without_added_mass(const TetMesh& mesh) {
  return TetSolid(mesh, {}, {}).substeps();
}

// Here more than by default, so that there is something. Volume and momentum stay, replicas follow, no edge that could
// go is left, and the volume needs less mass than it did, or smaller steps without.
TEST_P(VolumeCuts, C_LIM_1_short_edges_collapse_when_the_blade_is_out) {
  constexpr double kRatio = 0.3;
  BlockUnderBlade block(GetParam(), kRatio);
  block.go(0.025, 0.012);
  const auto& engine = dynamic_cast<const VolumeDeformation&>(*block.body().engines.deformation);
  const auto state = [&] {
    std::array<double, 4> sum{};  // momentum along all axes, mass
    for (VertexId v = 0; v < block.body().particles.size(); ++v) {
      const double mass_kg = engine.model().mass_kg(v);
      const Vec4f& u = block.body().particles.velocity_world_m_per_s[v];
      for (int i = 0; i < 3; ++i) sum[static_cast<std::size_t>(i)] += mass_kg * double{u[i]};
      sum[3] += mass_kg;
    }
    return sum;
  };
  const auto skin_m2 = [&] {
    double sum = 0;
    const auto& x = block.body().mesh.rest_body_m();
    for (const auto& [v, surface] : block.body().mesh.triangles())
      if (v[0] != kNone && surface == Surface::skin) sum += (x[v[1]] - x[v[0]]).cross(x[v[2]] - x[v[0]]).norm() / 2;
    return sum;
  };
  const double skin_before_m2 = skin_m2();
  const auto before = state();
  const TetTopology& volume = block.cutting().volume();
  const TetMesh mesh_before = volume.mesh();
  const double volume_m3 = block.volume_m3(), quality = worst_quality(volume);
  const double added = engine.diagnostics().added_mass_fraction;
  const auto short_before = short_edges(block.body(), block.cutting(), kRatio);
  auto replica = mesh_of(keyframe_of(block.body().mesh));
  int deltas = 0;
  for (int n = 0; n < 1000; ++n) {
    const TidyPlan plan = block.body().engines.cutting->tidy(block.body().shared());
    ASSERT_TRUE(block.body().apply({Cause::tidied, plan.delta, {}, plan.ticket}));
    const TopologyDelta& delta = plan.delta;
    if (delta.empty()) continue;
    ASSERT_EQ(apply(*delta_from_bytes(to_bytes(delta)), *replica), ApplyStatus::applied);
    ASSERT_EQ(replica->hash(), block.body().mesh.hash());
    const SurfaceReport surface = check(*replica);
    ASSERT_TRUE(surface.valid()) << surface.first_defect;
    ++deltas;
  }
  EXPECT_GT(deltas, 10);
  const TetMesh mesh = volume.mesh();
  EXPECT_LT(mesh.tetrahedra.size() + 40, mesh_before.tetrahedra.size());
  EXPECT_TRUE(check(mesh).conforming) << check(mesh).first_defect;
  EXPECT_NEAR(check(mesh).volume_m3, volume_m3, 3e-5 * volume_m3);
  EXPECT_NEAR(block.volume_m3(), check(mesh).volume_m3, 1e-9 * volume_m3) << "the surface is the volume's";
  EXPECT_NEAR(skin_m2(), skin_before_m2, 1e-4 * skin_before_m2) << "lips are where they were";
  EXPECT_GE(worst_quality(volume), quality);
  const auto after = state();
  EXPECT_NEAR(after[3], before[3], 3e-5 * before[3]);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(after[i], before[i], 1e-6 * before[3]) << i;

  const auto short_after = short_edges(block.body(), block.cutting(), kRatio);
  EXPECT_GT(short_before.at("fine"), 10);
  EXPECT_FALSE(short_after.contains("fine"));
  for (const auto& [why, count] : short_after) RecordProperty("short_edges_" + why, count);
  EXPECT_LE(parts_without_added_mass(mesh), parts_without_added_mass(mesh_before));
  EXPECT_LE(engine.diagnostics().added_mass_fraction, 0.8 * added + 1e-15);  // a lattice has none but for rounding
  RecordProperty("added_mass_percent",
                 std::to_string(100 * added) + ", " + std::to_string(100 * engine.diagnostics().added_mass_fraction));
  for (int n = 0; n < 100; ++n) block.body().deform({}, {}, 0.001);
  EXPECT_EQ(engine.first_bad_vertex(), kNone);
}

TEST_P(VolumeCuts, what_is_fixed_does_not_collapse) {
  BlockUnderBlade block(GetParam(), 0.45);
  block.go(0.025, -0.01);
  const TetTopology& volume = block.cutting().volume();
  const auto fixed = [&] {
    std::size_t n = 0;
    for (VertexId v = 0; v < volume.vertex_count(); ++v)
      n += volume.alive(v) && volume.vertex(v).rest_body_m.z() <= 0.004;
    return n;
  };
  const std::size_t before = fixed(), all = volume.mesh().vertices_body_m.size();
  for (int n = 0; n < 1000; ++n) {
    const TidyPlan plan = block.body().engines.cutting->tidy(block.body().shared());
    ASSERT_TRUE(block.body().apply({Cause::tidied, plan.delta, {}, plan.ticket}));
  }
  EXPECT_LT(volume.mesh().vertices_body_m.size() + 15, all);
  EXPECT_EQ(fixed(), before);
}

// A refused delta changes nothing, and another step tries again.
TEST_P(VolumeCuts, a_collapse_that_is_not_accepted_leaves_all_as_it_was) {
  BlockUnderBlade block(GetParam(), 0.3);
  block.go(0.025, 0.012);
  TidyPlan plan;
  for (int n = 0; n < 400 && plan.delta.empty(); ++n) {
    plan = block.body().engines.cutting->tidy(block.body().shared());
    EXPECT_TRUE(!plan.delta.empty() || block.body().apply({Cause::tidied, {}, {}, plan.ticket}));
  }
  ASSERT_FALSE(plan.delta.empty());
  const std::uint64_t hash = block.body().mesh.hash();
  const TetMesh before = block.cutting().volume().mesh();
  const TetMesh& followed = dynamic_cast<const VolumeDeformation&>(*block.body().engines.deformation).model().mesh();
  const std::vector<Tetrahedron> model_before = followed.tetrahedra;
  plan.delta.hash_after += 1;
  EXPECT_FALSE(block.body().apply({Cause::tidied, plan.delta, {}, plan.ticket}));
  EXPECT_EQ(block.body().mesh.hash(), hash);
  EXPECT_EQ(block.cutting().volume().mesh().tetrahedra, before.tetrahedra);
  EXPECT_EQ(followed.tetrahedra, model_before);
}

TEST_P(VolumeCuts, C_CUT_8_what_is_cut_through_has_two_parts) {
  BlockUnderBlade block(GetParam());
  block.go(0.025, -0.01);
  EXPECT_EQ(check(block.body().mesh).components, 2u);
  EXPECT_EQ(check(block.cutting().volume().mesh()).components, 2u);
}

// A second blade comes from the side and ends at the cut: a T, and nothing comes off.
TEST_P(VolumeCuts, a_cut_that_ends_at_another_is_a_t_junction) {
  BlockUnderBlade block(GetParam());
  const double volume_m3 = block.volume_m3();
  block.go(0.025, 0.012);
  const std::uint64_t before = block.body().mesh.revision();
  for (double x_m = 0.035; x_m > 0.0013; x_m -= 0.0005) {
    Blade blade{Vec3(x_m, 0.0007, 0.02), Vec3::UnitZ()};
    blade.length_m = 0.1;
    BladeMotion motion{8, {blade}, x_m < 0.0018};
    motion.frame_world = block.body().spec.pose;
    std::vector<Entry> entries;
    if (x_m > 0.0349) entries.push_back({8, 0, Vec3::Constant(1.0 / 3)});
    const CutPlan plan = block.body().engines.cutting->plan(block.body().shared(), entries, std::array{motion});
    ASSERT_TRUE(block.body().apply(cut_as_planned(plan)));
    block.body().deform({}, {}, 0.001);
  }
  EXPECT_GT(block.body().mesh.revision(), before + 3);
  const SurfaceReport surface = check(block.body().mesh);
  EXPECT_TRUE(surface.valid()) << surface.first_defect;
  EXPECT_NEAR(surface.volume_m3, volume_m3, 1e-9 * volume_m3);
  EXPECT_EQ(check(block.cutting().volume().mesh()).components, 1u);
  for (int n = 0; n < 100; ++n) block.body().deform({}, {}, 0.001);
  EXPECT_EQ(block.body().engines.deformation->first_bad_vertex(), kNone);
}

TEST_P(VolumeCuts, a_plan_that_is_not_accepted_leaves_all_as_it_was) {
  BlockUnderBlade block(GetParam());
  const TetMesh before = block.cutting().volume().mesh();
  const std::uint64_t hash = block.body().mesh.hash();
  ASSERT_TRUE(block.body().apply(cut_as_planned(block.plan_to(-0.025, 0.02))));  // the stroke has begun
  const CutPlan plan = block.plan_to(0.01, 0.02);
  ASSERT_FALSE(plan.delta.empty());
  EXPECT_EQ(block.body().mesh.hash(), hash);
  const TetMesh after = block.cutting().volume().mesh();
  EXPECT_EQ(after.vertices_body_m, before.vertices_body_m);
  EXPECT_EQ(after.tetrahedra, before.tetrahedra);
}

// Progressive: the front is undone and made anew in most steps.
class VolumeFronts : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, VolumeFronts, testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(VolumeFronts, C_CUT_3_a_plan_that_is_not_accepted_leaves_the_front_as_it_was) {
  BlockUnderBlade block(GetParam(), 0, "progressive");
  double y_m = -0.025;
  for (; y_m < 0 || !block.cutting().has_front(); y_m += 0.0005) {
    ASSERT_LT(y_m, 0.01) << "there is none";
    block.cut_to(y_m, 0.02);
  }
  const TetMesh before = block.cutting().volume().mesh();
  const std::uint64_t hash = block.body().mesh.hash();
  const CutPlan plan = block.plan_to(y_m + 0.001, 0.02);
  ASSERT_FALSE(plan.delta.empty());
  EXPECT_EQ(block.body().mesh.hash(), hash);
  const TetMesh after = block.cutting().volume().mesh();
  EXPECT_EQ(after.vertices_body_m, before.vertices_body_m);
  EXPECT_EQ(after.tetrahedra, before.tetrahedra);
  EXPECT_TRUE(block.body().apply(cut_as_planned(plan)));
  EXPECT_NE(block.body().mesh.hash(), hash);
}

// Replicas follow, the surface is that of the volume, and a step's delta is as large as the front, not as the cut.
TEST_P(VolumeFronts, C_CUT_3_every_delta_leaves_the_surface_of_the_volume_and_is_no_larger_than_the_front) {
  BlockUnderBlade block(GetParam(), 0, "progressive");
  const double volume_m3 = block.volume_m3();
  auto replica = mesh_of(keyframe_of(block.body().mesh));
  ASSERT_TRUE(replica);
  std::vector<std::size_t> edits;
  const auto look = [&](const CutPlan& plan) {
    edits.push_back(plan.delta.triangles.size());
    ASSERT_EQ(apply(plan.delta, *replica), ApplyStatus::applied);
    EXPECT_TRUE(replica->same_database(block.body().mesh));
    const SurfaceReport surface = check(*replica);
    EXPECT_TRUE(surface.valid()) << surface.first_defect;
    EXPECT_NEAR(surface.volume_m3, volume_m3, 1e-9 * volume_m3);
    const TetReport inside = check(block.cutting().volume().mesh());
    EXPECT_TRUE(inside.conforming) << inside.first_defect;
    EXPECT_NEAR(inside.volume_m3, volume_m3, 1e-9 * volume_m3);
  };
  block.go(0.025, 0.02, look, 0.0003);
  ASSERT_GT(edits.size(), 30u);
  std::size_t most = 0;
  for (const std::size_t n : edits) most = std::max(most, n);
  EXPECT_LT(most, 200u);
  EXPECT_FALSE(block.cutting().has_front());  // the blade is out: all is final
}

TEST_P(VolumeFronts, slow_and_fast_strokes_leave_about_as_many_tetrahedra) {
  std::vector<double> tetrahedra;
  for (const double step_m : {0.00005, 0.002}) {
    BlockUnderBlade block(GetParam(), 0, "progressive");
    const auto before = static_cast<double>(block.cutting().volume().mesh().tetrahedra.size());
    block.go(0.025, 0.012, {}, step_m);
    tetrahedra.push_back(static_cast<double>(block.cutting().volume().mesh().tetrahedra.size()) - before);
    EXPECT_EQ(block.engine().first_bad_vertex(), kNone);
    EXPECT_LT(block.engine().diagnostics().added_mass_fraction, 0.12);
  }
  EXPECT_LT(tetrahedra[0], 1.3 * tetrahedra[1]);
  EXPECT_GT(tetrahedra[0], 0.7 * tetrahedra[1]);
}

// At its lower edge as at its leading one; style semi_progressive ends with the last elements that are cut through
// whole.
TEST_P(VolumeFronts, C_CUT_3_the_cut_is_as_deep_as_the_blade) {
  const double width_m = 0.04, depth_m = 0.04 - 0.012;
  for (const double step_m : {0.0003, 0.002}) {
    BlockUnderBlade block(GetParam(), 0, "progressive"), whole(GetParam());
    block.go(0.025, 0.012, {}, step_m);
    whole.go(0.025, 0.012, {}, step_m);
    EXPECT_NEAR(block.walls_m2(), 2 * width_m * depth_m, 0.11 * 2 * width_m * depth_m) << step_m;
    EXPECT_LT(whole.walls_m2(), 0.8 * 2 * width_m * depth_m) << step_m;
  }
}

// An opening stays open, however often the blade goes back and forth in it.
TEST_P(VolumeFronts, a_blade_that_goes_back_and_forth_opens_nothing_twice) {
  BlockUnderBlade block(GetParam(), 0, "progressive");
  for (double y_m = -0.025; y_m < 0; y_m += 0.0005) block.cut_to(y_m, 0.02);
  const std::size_t tetrahedra = block.cutting().volume().mesh().tetrahedra.size();
  const double area_m2 = block.walls_m2();
  EXPECT_NEAR(area_m2, 2 * 0.02 * 0.02, 0.16 * 2 * 0.02 * 0.02);
  for (int n = 0; n < 5; ++n) {
    for (double y_m = -0.001; y_m > -0.003; y_m -= 0.0005) EXPECT_TRUE(block.cut_to(y_m, 0.02).delta.empty());
    for (double y_m = -0.003; y_m < 0; y_m += 0.0005) block.cut_to(y_m, 0.02);
  }
  EXPECT_LT(static_cast<double>(block.cutting().volume().mesh().tetrahedra.size()),
            1.1 * static_cast<double>(tetrahedra));
  EXPECT_NEAR(block.walls_m2(), area_m2, 0.05 * area_m2);
}

// In a body that is in motion and sags: the tissue stays where it is, whatever elements it is in.
TEST_P(VolumeFronts, A_20_a_front_that_is_made_anew_leaves_energy_and_momentum_as_they_were) {
  BlockUnderBlade block(GetParam(), 0, "progressive");
  for (double y_m = -0.025; y_m < -0.004; y_m += 0.0005) block.cut_to(y_m, 0.02);
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (VertexId v = 0; v < block.body().particles.size(); ++v) {
      const Vec4f& u = block.body().particles.velocity_world_m_per_s[v];
      sum += block.engine().model().mass_kg(v) * u.head<3>().cast<double>();
    }
    return sum;
  };
  const double mass_kg = 1060 * 0.06 * 0.04 * 0.04, size_j = mass_kg * 9.81 * 0.04;
  int fronts = 0;
  for (double y_m = -0.004; y_m < 0.008; y_m += 0.0003) {
    const CutPlan plan = block.plan_to(y_m, 0.02);
    const Vec3 momentum_before = momentum();
    const double energy_j = block.body().engines.deformation->energy_j(block.body().shared());
    ASSERT_TRUE(block.body().apply(cut_as_planned(plan)));
    fronts += !plan.delta.empty();
    if (GetParam() != "neo_hookean_lattice") {  // the momentum of a lattice is that of its nodes
      EXPECT_LT((momentum() - momentum_before).norm(), 1e-6 * mass_kg) << y_m;
    }
    EXPECT_LT(block.body().engines.deformation->energy_j(block.body().shared()), energy_j + 1e-3 * size_j) << y_m;
    block.body().deform({}, {}, 0.001);
  }
  EXPECT_GT(fronts, 15);
  for (int n = 0; n < 200; ++n) block.body().deform({}, {}, 0.001);
  EXPECT_EQ(block.engine().first_bad_vertex(), kNone);
  for (const Vec3f& x : block.body().positions_world_m()) EXPECT_LT(x.norm(), 0.1f);
}

// Nothing comes off but what is cut off, however a hand trembles: what would be a crumb stays with its neighbour.
TEST(VolumeFrontsOfHands, a_trembling_blade_leaves_no_crumbs) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    BlockUnderBlade block("neo_hookean", 0, "progressive");
    test::Random random(seed);
    std::normal_distribution<double> tremor(0, 0.0004);
    for (double y_m = -0.025; y_m < 0.026; y_m += 0.0004) {
      const Vec3 tip(0.0013 + tremor(random), y_m + tremor(random), 0.012 + tremor(random));
      const CutPlan plan = block.plan(std::array{block.motion(7, tip, Vec3::UnitZ(), y_m > 0.0255)});
      ASSERT_TRUE(block.body().apply(cut_as_planned(plan)));
      block.body().deform({}, {}, 0.001);
      ASSERT_EQ(check(block.cutting().volume().mesh()).components, 1u) << seed << ", " << y_m;
    }
    EXPECT_GT(block.walls_m2(), 1.7 * 0.04 * 0.028) << seed;
  }
}

// Tissue that hangs swings aside under the blade. All that its edge went over is cut: no thread is left between the end
// of the front and the place from which the cut goes on.
TEST(VolumeFrontsOfHands, tissue_that_swings_aside_leaves_no_thread) {
  for (const double aside_m : {0.0025, 0.003, 0.0035, -0.003, -0.0032, -0.0036, -0.004}) {
    BlockUnderBlade block("neo_hookean", 0, "progressive");
    const auto to = [&](double x_m, double y_m, bool lift = false) {
      const CutPlan plan = block.plan(std::array{block.motion(7, Vec3(x_m, y_m, -0.01), Vec3::UnitZ(), lift)});
      ASSERT_TRUE(block.body().apply(cut_as_planned(plan)));
    };
    for (double y_m = -0.025; y_m < 0.004; y_m += 0.0005) to(0.0013, y_m);
    for (double y_m = 0.0035; y_m < 0.026; y_m += 0.0005) to(0.0013 + aside_m, y_m);
    EXPECT_EQ(check(block.cutting().volume().mesh()).components, 2u) << aside_m;
  }
}

// A blade that presses on the skin behind a slit has come through the slit: a place outside the body, far behind, is on
// no way through tissue.
TEST(VolumeFrontsOfHands, a_blade_that_comes_in_through_a_slit_cuts_nothing_behind_it) {
  BlockUnderBlade block("neo_hookean", 0, "progressive");
  for (double y_m = -0.025; y_m < 0.01; y_m += 0.0005) block.cut_to(y_m, 0.01);
  block.cut_to(0.01, 0.01, true);
  const double before_m2 = block.walls_m2();
  BladeMotion motion = block.motion(8, Vec3(0.006, 0.012, 0.01), Vec3::UnitZ(), false);
  motion.path.insert(motion.path.begin(), block.motion(8, Vec3(0.006, -0.025, 0.01), Vec3::UnitZ(), false).path[0]);
  ASSERT_TRUE(block.body().apply(cut_as_planned(block.plan(std::array{motion}))));
  EXPECT_LT(block.walls_m2(), before_m2 + 2 * 0.01 * 0.03);
}

}  // namespace
}  // namespace sectio::volume_test
