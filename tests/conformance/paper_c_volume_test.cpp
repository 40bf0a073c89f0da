// Paper C: its own scene, friction of the floor, and the two limits that it names for masses and stiffness, beside its
// own way as a baseline.
#include <gtest/gtest.h>

#include <numeric>

#include "common/mesh/check.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/exercise_score.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/gripper.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {
namespace {

const std::string kPaperBox = SECTIO_SOURCE_DIR "/deploy/scenes/paper_box.yaml";

Region ball(const char* name, const Vec3& centre_m, double radius_m) {
  Region region;
  region.name = name;
  region.marked = true;
  region.parts = {{RegionForm::ellipsoid, centre_m, Vec3::Constant(radius_m), 0, 0, Eigen::Quaterniond::Identity()}};
  return region;
}
double ball_m3(double radius_m) {
  return 4.0 / 3 * M_PI * radius_m * radius_m * radius_m;
}

TEST(C_CUT, C_CUT_8_the_corner_of_the_papers_box_is_cut_off_and_carried_away) {
  Scene scene = load_scene(kPaperBox, standard_traits());
  // Beside it a score: of two marked balls one is all in the corner, the knife goes through the other's middle.
  scene.bodies[0].regions = {ball("in", Vec3(0.035, 0.035, 0), 0.004), ball("across", Vec3(0.025, 0.025, 0), 0.007)};
  scene.exercise = ExerciseSpec{"box", Box{Vec3(0.03, 0.03, -0.01), Vec3(0.1, 0.1, 0.1)}, {}};
  Simulation simulation(prepared(scene));
  ExerciseScore score(scene, simulation);
  const double whole_m3 = check(simulation.mesh(0)).volume_m3;
  std::map<std::string, int> events;
  StepInput input;
  for (std::uint64_t k = 1; k <= steps_of(scene, 0); ++k) {
    input.samples = samples_of_traces(scene, k);
    const StepOutput& output = simulation.step(input);
    for (const Event& e : output.events) ++events[to_string(e.kind) + (" " + e.text)];
    score.add(output);
  }
  EXPECT_EQ(events["grasped "], 2);
  EXPECT_EQ(events["grasped came off"], 1) << "what was held goes on being held";
  EXPECT_EQ(events["released opened"], 1);
  EXPECT_EQ(events["released slipped"], 0);
  double carried_m3 = 0, left_m3 = 0;  // by components, wherever they are kept
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b) {
    const TriangleMesh& mesh = simulation.mesh(b);
    for (const Triangle& t : mesh.triangles()) {
      if (!t.alive()) continue;
      const auto& x = mesh.rest_body_m();
      const double part = x[t.v[0]].dot(x[t.v[1]].cross(x[t.v[2]])) / 6;
      const Vec3f& now = simulation.positions_world_m(b)[t.v[0]];
      (now.x() + now.y() > 0.07f ? carried_m3 : left_m3) += part;
    }
  }
  EXPECT_NEAR(carried_m3 + left_m3, whole_m3, 1e-9 * whole_m3);
  EXPECT_NEAR(carried_m3, 0.5 * 0.03 * 0.03 * 0.025, 0.15 * 0.5 * 0.03 * 0.03 * 0.025) << "where the knife went";

  const double in_m3 = ball_m3(0.004), across_m3 = ball_m3(0.007);
  const Score result = score.finish();
  EXPECT_NEAR(result.marked_m3, in_m3 + across_m3, 0.02 * across_m3);
  EXPECT_NEAR(result.marked_removed_m3, in_m3 + across_m3 / 2, 0.1 * across_m3);
  EXPECT_NEAR(result.marked_removed_m3 + result.healthy_lost_m3, carried_m3, 0.02 * carried_m3);
  EXPECT_TRUE(result.in_bin);
}

TEST(C_NUM, C_NUM_1_the_papers_box_has_the_papers_numbers) {
  Scene scene = load_scene(kPaperBox, standard_traits());
  const Simulation simulation(prepared(scene));
  EXPECT_NE(simulation.body(0).mesh_notes[0].find("196 tetrahedra, 74 vertices"), std::string::npos);
  EXPECT_EQ(TetSprings(simulation.body(0).tets, {}, {}).springs().size(), 1167u);
}

// A block thrown along the floor by a tilted gravity.
double slid_m(const std::string& model, double kept_velocity, int steps = 400) {
  Scene scene = block_with_forceps(model);
  scene.floor_z_m = 0;
  scene.gravity_m_per_s2 = Vec3(3, 0, -9.81);
  scene.bodies[0].fixed.reset();
  scene.bodies[0].mesh = box(4, 4, 3, Vec3(0.06, 0.06, kBlockTop_m));
  scene.bodies[0].volume.tetrahedra = 400;
  scene.bodies[0].volume.floor_kept_velocity = kept_velocity;
  scene.bodies[0].material.damping_per_s = 2;
  scene.bodies[0].material.young_pa = 20000;
  Operation op(scene);
  op.rest(steps);
  double sum = 0;
  for (const Vec3& x : positions_of(op)) sum += x.x();
  return sum / static_cast<double>(op.mesh().vertex_count());
}

TEST(C_CON, C_CON_2_the_floor_keeps_the_fraction_of_velocity_that_friction_leaves) {
  for (const char* model : {"tetra_springs", "neo_hookean"}) {
    const double high = slid_m(model, 0), low = slid_m(model, 1);
    EXPECT_LT(high, 0.02) << "it leans and stays";
    EXPECT_NEAR(slid_m(model, 0, 1600), slid_m(model, 0, 800), 1e-4) << "and does not creep";
    EXPECT_NEAR(low, 3.0 / 2 * (0.4 - (1 - std::exp(-0.8)) / 2), 0.02) << "as if there were no floor";
    EXPECT_GT(slid_m(model, 0.5), high + 0.01);
    EXPECT_LT(slid_m(model, 0.5), low - 0.01);
  }
}

// The paper's own way: every vertex keeps its first mass, and every spring its first constant.
struct PapersWay {
  double mass_kg, edge_n_per_m, second_n_per_m;

  explicit PapersWay(const TetSprings& whole) {
    double mass = 0, edge = 0, second = 0;
    const auto n = whole.springs();
    for (std::size_t k = 0; k < n.size(); ++k) (k < whole.edge_count() ? edge : second) += n[k].stiffness_n_per_m;
    VertexId vertices = 0;
    for (const TetSprings::Spring& s : n) vertices = std::max(vertices, s.b + 1);
    for (VertexId v = 0; v < vertices; ++v) mass += whole.mass_kg(v);
    mass_kg = mass / vertices;
    edge_n_per_m = edge / static_cast<double>(whole.edge_count());
    second_n_per_m = second / static_cast<double>(n.size() - whole.edge_count());
  }
  std::vector<TetSprings::Spring> springs(const TetSprings& of) const {
    std::vector<TetSprings::Spring> mine = of.springs();
    for (std::size_t k = 0; k < mine.size(); ++k)
      mine[k].stiffness_n_per_m = k < of.edge_count() ? edge_n_per_m : second_n_per_m;
    return mine;
  }
};

TetMesh block_of_tetrahedra() {
  return tet_box(5, 4, 3, Vec3(0.10, 0.08, 0.06));
}

// Five slits side by side, each halfway into the block.
TetTopology slit(const TetMesh& whole) {
  TetTopology volume(whole);
  for (int n = 0; n < 5; ++n) {
    const double x = 0.0151 + 0.0173 * n;
    cut(volume, {{{x, -0.01, 0.031}, {x, 0.09, 0.031}, {x, 0.09, 0.07}, {x, -0.01, 0.07}}}, {});
  }
  return volume;
}

double mass_of(const TetSprings& springs, std::size_t vertices) {
  double sum = 0;
  for (VertexId v = 0; v < vertices; ++v) sum += springs.mass_kg(v);
  return sum;
}

TEST(C_LIM, C_LIM_2_masses_by_volume_stay_those_of_the_tissue_while_equal_ones_grow_where_it_is_cut) {
  const TetMesh whole = block_of_tetrahedra(), after = slit(whole).mesh();
  const TetSprings before(whole, {}, {}), cut_open(after, {}, {});
  const std::size_t n = whole.vertices_body_m.size(), m = after.vertices_body_m.size();
  ASSERT_GT(m, n + 100);
  const double mass_kg = 1060 * 0.10 * 0.08 * 0.06;
  EXPECT_NEAR(mass_of(before, n), mass_kg, 1e-12);
  EXPECT_NEAR(mass_of(cut_open, m), mass_kg, 1e-12);
  // And it is where it was: the slits are in the upper half.
  double height = 0, papers_height = 0;
  for (VertexId v = 0; v < m; ++v) {
    height += cut_open.mass_kg(v) / mass_kg * after.vertices_body_m[v].z();
    papers_height += after.vertices_body_m[v].z() / static_cast<double>(m);
  }
  EXPECT_NEAR(height, 0.03, 1e-3);
  const PapersWay papers(before);
  EXPECT_GT(papers.mass_kg * static_cast<double>(m), 1.8 * mass_kg) << "the baseline: a heavier block";
  EXPECT_GT(papers_height, 0.035) << "which is top-heavy";
}

TEST(C_LIM, C_LIM_3_springs_in_series_are_as_stiff_as_the_one_they_were_cut_from) {
  TetMesh tet;
  tet.vertices_body_m = {{0, 0, 0}, {0.05, 0, 0}, {0, 0.05, 0}, {0, 0, 0.05}};
  tet.tetrahedra = {{0, 1, 2, 3}};
  const TetSpringOptions edges_only{0, 0, false};
  const auto stiffness = [](const TetSprings& springs, VertexId a, VertexId b) {
    for (const TetSprings::Spring& s : springs.springs())
      if (s.a == std::min(a, b) && s.b == std::max(a, b)) return s.stiffness_n_per_m;
    return 0.0;
  };
  const double before = stiffness(TetSprings(tet, {}, {}, edges_only), 0, 1);
  for (const double t : {0.5, 0.3}) {
    TetTopology volume(tet);
    const VertexId n = volume.split(0, 1, t);
    const TetSprings halves(volume.mesh(), {}, {}, edges_only);
    const double series = 1 / (1 / stiffness(halves, 0, n) + 1 / stiffness(halves, n, 1));
    EXPECT_NEAR(series, before, 1e-9 * before);
  }
}

// Slits take nothing of a block's stiffness along them.
TEST(C_LIM, C_LIM_3_a_slit_block_is_as_stiff_along_its_slits_as_before_while_equal_constants_change_it) {
  const TetMesh whole = block_of_tetrahedra(), after = slit(whole).mesh();
  for (const double second_share : {0.0, 0.5}) {
    const TetSpringOptions options{second_share, 0, false};
    const TetSprings before(whole, {}, {}, options), cut_open(after, {}, {}, options);
    const PapersWay papers(before);
    const auto change = [&](std::span<const TetSprings::Spring> from, std::span<const TetSprings::Spring> to) {
      return tensile_test(after, to).young_pa[1] / tensile_test(whole, from).young_pa[1] - 1;
    };
    const double ours = change(before.springs(), cut_open.springs());
    const double theirs = change(papers.springs(before), papers.springs(cut_open));
    EXPECT_LT(std::abs(ours), 0.1);
    EXPECT_GT(std::abs(theirs), 3 * std::abs(ours));
  }
}

}  // namespace
}  // namespace sectio::test
