// A storm of a thousand random cuts of volumes, in deformed states, into each other: rectangles of all sizes. After
// each of them short edges collapse, inside and on the surface.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/volume/tets/collapse.h"
#include "sim_server/volume/tets/front_rollback.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/random.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

// The bound of shape_quality() where twenty sheets cross in 320 tetrahedra. Each crossing may leave 0.05 of an edge: of
// 8 000 cuts, with seeds moved by 0 to 7000, all but one leave 2.5e-5 or more, and that one 4e-7.
const double kLeastQuality = test::bound(5e-5, 1e-7);
const double kSameVolume = test::bound(1e-4, 2e-4);  // after all collapses, of the whole

double worst_quality(const TetTopology& volume) {
  double worst = 1;
  for (std::uint32_t t = 0; t < volume.tetrahedra().size(); ++t)
    if (volume.tetrahedra()[t] != kNoTetrahedron) worst = std::min(worst, shape_quality(volume, t));
  return worst;
}

std::vector<TetChange> collapse_all(TetTopology& volume, double ratio) {
  std::vector<TetChange> changes;
  for (std::size_t before = 1; before != changes.size();) {
    before = changes.size();
    for (VertexId v = 0; v < volume.vertex_count(); ++v)
      if (const auto onto = collapse_onto(volume, v, ratio)) changes.push_back(volume.collapse(v, *onto));
  }
  return changes;
}

// omega h of the model that has followed, at rest: below 2 it is stable.
double step_over_limit(const TetTopology& volume, const TetSolid& solid, const VolumeMaterial& m, double part_s) {
  const TetMesh mesh = volume.mesh();
  const double mu = m.young_pa / (2 * (1 + m.poisson)), lambda = 2 * mu * m.poisson / (1 - 2 * m.poisson);
  TetStiffness stiffness;
  stiffness.shear_pa.assign(mesh.tetrahedra.size(), mu);
  stiffness.bulk_pa.assign(mesh.tetrahedra.size(), lambda + mu);
  std::vector<double> inverse_mass;
  for (VertexId v = 0; v < volume.vertex_count(); ++v)
    if (volume.alive(v)) inverse_mass.push_back(solid.inverse_mass_per_kg(v));
  return std::sqrt(largest_omega2_at_rest(mesh, stiffness, inverse_mass)) * part_s;
}

class TetStorm : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, TetStorm, testing::Range(0u, 50u));

TEST_P(TetStorm, C_LIM_1_every_cut_leaves_a_conforming_volume_of_the_same_size_that_the_step_before_is_stable_for) {
  test::Random random(GetParam());
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.08, 0.08, 0.08));
  test::jitter(mesh, 0.003);
  TetTopology volume(mesh);
  // A shear, a stretch and a bend, so that places at rest and in the world differ.
  const Vec3 bend = 3 * vector();
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3 p = mesh.vertices_body_m[v] - Vec3(0.04, 0.04, 0.04);
    volume.set_state(
        v, Vec3(1.2 * p.x() + bend.x() * p.y() * p.z(), 0.9 * p.y() + 0.2 * p.x(), p.z() + bend.y() * p.x() * p.x()),
        vector());
  }
  const double whole_m3 = check(mesh).volume_m3;
  const TetCutSettings settings{GetParam() % 3 == 0 ? 0.1 : 0.05, GetParam() % 5 == 4};
  const VolumeMaterial material;
  std::optional<TetSolid> solid;
  if (GetParam() % 10 == 0) solid.emplace(mesh, material, VolumeSettings());
  int risen = 0;  // rises of the worst quality, with a cut's short edges
  for (int n = 0; n < 20; ++n) {
    const Vec3 at = Vec3::Constant(0.04) + 0.035 * vector(), normal = vector().normalized();
    const double size = n % 4 == 0 ? 1 : 0.005 + 0.03 * std::abs(uniform(random));
    const Vec3 u = size * normal.unitOrthogonal(), w = size * normal.cross(normal.unitOrthogonal());
    const CutSheet sheet{{at - u - w, at + u - w, at + u + w, at - u + w}};
    const std::size_t mark = volume.mark(), tets = volume.tetrahedra().size(), vertices = volume.vertex_count();
    const TetMesh before = volume.mesh();
    cut(volume, sheet, settings);
    const TetReport report = check(volume.mesh());
    ASSERT_TRUE(report.conforming) << "cut " << n << ": " << report.first_defect;
    ASSERT_NEAR(report.volume_m3, check(before).volume_m3, 1e-12 * whole_m3) << n;
    if (n % 5 == 2) {
      volume.undo_to(mark);
      ASSERT_EQ(volume.tetrahedra().size(), tets);
      ASSERT_EQ(volume.vertex_count(), vertices);
      ASSERT_EQ(volume.mesh().tetrahedra, before.tetrahedra);
      cut(volume, sheet, settings);
    }
    const TetChange change = volume.change();
    volume.forget();
    const double worst = worst_quality(volume);
    const std::vector<TetChange> collapses = collapse_all(volume, settings.collapse_ratio);
    ASSERT_GE(worst_quality(volume), std::max(worst, kLeastQuality)) << n;
    risen += worst_quality(volume) > 1.1 * worst;
    if (!collapses.empty()) {
      const TetReport thinned = check(volume.mesh());
      ASSERT_TRUE(thinned.conforming) << "after cut " << n << ": " << thinned.first_defect;
      ASSERT_EQ(thinned.components, report.components) << n;
      ASSERT_NEAR(thinned.volume_m3, whole_m3, kSameVolume * whole_m3) << n;
    }
    if (!solid) continue;
    solid->change(change);
    for (const TetChange& collapse : collapses) solid->change(collapse);
  }
  EXPECT_GT(risen, test::bound(1, -1)) << "the worst are not those that collapse";
  if (!solid) return;
  EXPECT_LT(step_over_limit(volume, *solid, material, VolumeSettings().step_s / solid->substeps()), 2);
}

bool same(const TetTopology& a, const TetTopology& b) {
  if (a.vertex_count() != b.vertex_count() || !std::ranges::equal(a.tetrahedra(), b.tetrahedra())) return false;
  for (VertexId v = 0; v < a.vertex_count(); ++v)
    if (a.vertex(v).rest_body_m != b.vertex(v).rest_body_m || !std::ranges::equal(a.star(v), b.star(v))) return false;
  return true;
}

// Blades that go on a little at a time, through each other's cuts: the front is taken back and made anew, and a model
// that follows what that comes to is what one is that was made of the volume.
class TetFronts : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, TetFronts, testing::Range(0u, 20u));

TEST_P(TetFronts, C_CUT_3_a_front_is_undone_exactly_and_models_follow_what_has_changed) {
  test::Random random(GetParam());
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.08, 0.08, 0.08));
  test::jitter(mesh, 0.003);
  for (Vec3& x : mesh.vertices_body_m) x -= Vec3::Constant(0.04);
  TetTopology volume(mesh);
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3 p = mesh.vertices_body_m[v];
    volume.set_state(v, Vec3(1.1 * p.x(), p.y() + 0.2 * p.z(), 0.9 * p.z()), Vec3(p.y(), -p.x(), 2 * p.z()));
  }
  const double whole_m3 = check(mesh).volume_m3;
  VolumeMaterial material;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) material.stiffness_factor.push_back(t % 3 == 0 ? 2 : 1);
  TetSolid solid(mesh, material, VolumeSettings());
  std::vector<double> factors = material.stiffness_factor;
  for (int stroke = 0; stroke < 3; ++stroke) {
    const Vec3 ahead = vector().normalized(), up = ahead.unitOrthogonal();
    const Vec3 tip = 0.02 * vector() - 0.07 * ahead - 0.03 * up, heel = tip + 0.15 * up;
    const TetTopology without = volume;
    TetDelta front;
    for (int n = 1; n <= 8; ++n) {
      const Vec3 noise = 2e-4 * vector();
      const Vec3 gone = (0.04 + 0.008 * n) * ahead + noise;
      const TetTopology was = volume;
      TetTopology now = volume;
      FrontRollback rollback(now, n == 1 ? nullptr : &front);
      ASSERT_TRUE(same(now, without)) << stroke << ' ' << n;
      cut(now, {{tip, heel, heel + gone, tip + gone}, {}, 2 | 4 | 8}, {});
      const TetReport report = check(now.mesh());
      ASSERT_TRUE(report.conforming) << stroke << ' ' << n << ": " << report.first_defect;
      ASSERT_NEAR(report.volume_m3, whole_m3, 1e-12 * whole_m3);
      TetChange change = rollback.change();
      rollback.find_origins(change);
      rollback.give_states();
      ASSERT_TRUE(same(volume, was)) << stroke << ' ' << n << ": a draft changes nothing";
      // The new front as a value leads from the volume without a front to that of the plan, and back.
      const TetTopology planned = now;
      front = now.take_back();
      ASSERT_TRUE(same(now, without)) << stroke << ' ' << n;
      apply(front, now);
      ASSERT_TRUE(same(now, planned)) << stroke << ' ' << n;
      apply(inverse(front), now);
      ASSERT_TRUE(same(now, without)) << stroke << ' ' << n;
      volume = planned;
      volume.forget();
      // The field was linear: whoever takes over its state has that of the place at rest.
      for (VertexId v = 0; v < volume.vertex_count(); ++v) {
        const Vec3& p = volume.vertex(v).rest_body_m;
        ASSERT_LT((volume.vertex(v).position_world_m - Vec3(1.1 * p.x(), p.y() + 0.2 * p.z(), 0.9 * p.z())).norm(),
                  1e-9);
        ASSERT_LT((volume.vertex(v).velocity_m_per_s - Vec3(p.y(), -p.x(), 2 * p.z())).norm(), 1e-8);
      }
      solid.change(change);
      std::vector<double> after(volume.tetrahedra().size());
      for (std::uint32_t t = 0; t < std::min(after.size(), factors.size()); ++t) after[t] = factors[t];
      for (const TetEdit& e : change.tetrahedra)
        if (e.after != kNoTetrahedron) after[e.id] = factors[e.origin];
      factors = after;
    }
  }
  TetMesh made;
  for (VertexId v = 0; v < volume.vertex_count(); ++v) made.vertices_body_m.push_back(volume.vertex(v).rest_body_m);
  made.tetrahedra.assign(volume.tetrahedra().begin(), volume.tetrahedra().end());
  VolumeMaterial as_now;
  as_now.stiffness_factor = factors;
  const TetSolid anew(made, as_now, VolumeSettings());
  std::vector<Vec4f> x(solid.mesh().vertices_body_m.size(), Vec4f::Zero());
  for (VertexId v = 0; v < volume.vertex_count(); ++v) {
    EXPECT_EQ(solid.mesh().vertices_body_m[v], made.vertices_body_m[v]);
    EXPECT_NEAR(solid.mass_kg(v), anew.mass_kg(v), 1e-12 * anew.mass_kg(v));
    x[v].head<3>() = volume.vertex(v).position_world_m.cast<float>();
  }
  for (VertexId v = static_cast<VertexId>(volume.vertex_count()); v < x.size(); ++v) EXPECT_EQ(solid.mass_kg(v), 0);
  const double energy_j = anew.elastic_energy_j(std::span(x).first(volume.vertex_count()));
  EXPECT_NEAR(solid.elastic_energy_j(x), energy_j, 1e-4 * energy_j);
}

}  // namespace
}  // namespace sectio
