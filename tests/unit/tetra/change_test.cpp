// After any number of cuts, a model that has followed each of them equals one that is made from the cut volume.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/volume/tets/boundary_change.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/random.h"
#include "tests/support/tet_shapes.h"

namespace sectio::tetra_test {
namespace {

using test::Points;

class Random {
 public:
  explicit Random(std::uint32_t seed) : random_(seed) {}
  double operator()() { return uniform_(random_); }
  Vec3 vector() { return {(*this)(), (*this)(), (*this)()}; }
  CutSheet sheet() {
    const Vec3 at = Vec3(0.05, 0.05, 0.05) + 0.04 * vector(), normal = vector().normalized();
    const double size = 0.015 + 0.02 * std::abs((*this)());
    const Vec3 u = size * normal.unitOrthogonal(), w = size * normal.cross(normal.unitOrthogonal());
    return {{at - u - w, at + u - w, at + u + w, at - u + w}, {}};
  }

 private:
  test::Random random_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TetMesh uneven_block() {
  TetMesh mesh = test::tet_box(5, 5, 5, Vec3(0.1, 0.1, 0.1));
  test::jitter(mesh, 0.002);
  return mesh;
}

std::vector<std::uint8_t> fixed(std::span<const Vec3> vertices) {
  std::vector<std::uint8_t> fixed;
  for (const Vec3& p : vertices) fixed.push_back(p.z() < 0.01);
  return fixed;
}

VolumeMaterial with_stiff_spots() {
  VolumeMaterial material;
  for (std::size_t t = 0; t < uneven_block().tetrahedra.size(); ++t)
    material.stiffness_factor.push_back(t % 3 == 0 ? 2 : 1);
  return material;
}

constexpr double kSomeMass_s = 4e-4;  // some vertices need mass for such a step, and all of them get it

VolumeSettings settings(const TetMesh& mesh, double step_s = kSomeMass_s) {
  VolumeSettings settings;
  settings.step_s = settings.least_substep_s = step_s;
  settings.fixed = fixed(mesh.vertices_body_m);
  return settings;
}

TetChange with_fixed(TetChange change) {
  change.fixed = fixed(change.added_body_m);
  return change;
}

template <class Model>
void expect_same(const Model& followed, const Model& made, std::uint32_t seed) {
  const TetMesh& mesh = made.mesh();
  ASSERT_EQ(followed.mesh().tetrahedra, mesh.tetrahedra);
  Points x = test::at_rest(mesh);
  Random random(seed);
  for (Vec4f& p : x) p.head<3>() += 0.001f * random.vector().cast<float>();
  std::vector<Vec3> f(x.size()), g(x.size());
  followed.elastic_forces_n(x, f);
  made.elastic_forces_n(x, g);
  double largest = 0;
  for (const Vec3& force : g) largest = std::max(largest, force.norm());
  for (VertexId v = 0; v < x.size(); ++v) {
    EXPECT_NEAR(followed.mass_kg(v), made.mass_kg(v), 1e-12 * made.mass_kg(v)) << v;
    EXPECT_NEAR(followed.inverse_mass_per_kg(v), made.inverse_mass_per_kg(v), 1e-9 * made.inverse_mass_per_kg(v)) << v;
    ASSERT_LT((f[v] - g[v]).norm(), 1e-5 * largest) << v;
  }
  EXPECT_NEAR(followed.diagnostics().added_mass_fraction, made.diagnostics().added_mass_fraction, 1e-9);
  EXPECT_GT(made.diagnostics().added_mass_fraction, test::bound(0.0, -1.0));
  EXPECT_LT(made.diagnostics().added_mass_fraction, kMuchAddedMass);
  EXPECT_NEAR(followed.elastic_energy_j(x), made.elastic_energy_j(x), 1e-6 * made.elastic_energy_j(x));
}

// Each tetrahedron of the present volume has the factor of the one that it was cut out of.
VolumeMaterial material_of(const std::vector<double>& factors) {
  VolumeMaterial m;
  m.stiffness_factor = factors;
  return m;
}

class Changes : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, Changes, testing::Range(0u, 6u));

TEST_P(Changes, rows_are_those_of_a_model_made_anew) {
  Random random(GetParam());
  TetTopology volume(uneven_block());
  TetSolid solid(uneven_block(), with_stiff_spots(), settings(uneven_block()));
  TetSprings springs(uneven_block(), with_stiff_spots(), settings(uneven_block()), {0.5, 0, true});
  std::vector<double> factors = with_stiff_spots().stiffness_factor;
  for (int n = 0; n < 12; ++n) {
    cut(volume, random.sheet(), {0.08, n % 4 == 3});
    const TetChange change = with_fixed(volume.change());
    volume.forget();
    factors.resize(volume.tetrahedra().size());
    for (const TetEdit& e : change.tetrahedra) factors[e.id] = factors[e.origin];
    solid.change(change);
    springs.change(change);
    if (n % 4 != 3) continue;
    const TetMesh mesh = volume.mesh();
    const TetSolid solid_anew(mesh, material_of(factors), settings(mesh));
    expect_same(solid, solid_anew, GetParam());
    TetSpringOptions options = springs.options();
    options.calibrate = false;
    const TetSprings springs_anew(mesh, material_of(factors), settings(mesh), options);
    expect_same(springs, springs_anew, GetParam());
    for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
      ASSERT_EQ(springs.rows().degree(v), springs_anew.rows().degree(v)) << v;
      for (std::uint32_t k = 0; k < springs.rows().degree(v); ++k)
        ASSERT_EQ(springs.rows().half_edge(v, k), springs_anew.rows().half_edge(v, k)) << v;
    }
    EXPECT_EQ(springs.substep_limit_s(), springs_anew.substep_limit_s());
    // No two rows of a slice share a tetrahedron.
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (const auto& [i, j] : kTetEdges) ASSERT_NE(solid.rows().colour(t[i]), solid.rows().colour(t[j]));
    EXPECT_LE(solid.rows().colours(), solid_anew.rows().colours() + 6);
    EXPECT_EQ(solid.rows().row_count(), mesh.vertices_body_m.size());
  }
}

// Both integrators compute the same from overflow slices and from a new layout, also after many cuts and compactions.
TEST(Changes, a_body_that_is_cut_often_moves_like_one_made_anew) {
  Random random(77);
  TetTopology volume(uneven_block());
  TetSolid solid(uneven_block(), {}, settings(uneven_block(), 1e-3), VolumeIntegrator::implicit_only);
  bool compacted = false;
  for (int n = 0; n < 30; ++n) {
    cut(volume, random.sheet(), {});
    const std::uint32_t overflow = solid.rows().overflow_row_count();
    solid.change(with_fixed(volume.change()));
    volume.forget();
    compacted |= solid.rows().overflow_row_count() < overflow;
  }
  EXPECT_TRUE(compacted);
  EXPECT_LE(solid.rows().overflow_row_count(), std::max(256u, solid.rows().row_count() / 10));
  const TetMesh mesh = volume.mesh();
  TetSolid anew(mesh, {}, settings(mesh, 1e-3), VolumeIntegrator::implicit_only);
  Points x = test::at_rest(mesh), v = test::still(x), y = x, w = v;
  for (int n = 0; n < 20; ++n) {
    solid.step(x, v, {}, {});
    anew.step(y, w, {}, {});
  }
  const double fall_m = 0.5 * 9.81 * 0.02 * 0.02;
  double sum_m2 = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum_m2 += double{(x[i] - y[i]).head<3>().squaredNorm()};
  // A step may leave 2 % of the weight, which is much of that of a crumb.
  EXPECT_LT(std::sqrt(sum_m2 / static_cast<double>(x.size())), test::bound(0.1, 0.3) * fall_m);
}

// A vertex without tetrahedra has no row; the other rows are as if it had never existed.
TEST(Changes, what_has_left_is_gone) {
  TetTopology volume(uneven_block());
  const Vec3 at(0.052, 0.05, 0.05);
  cut(volume, {{at + Vec3(0, -1, -1), at + Vec3(0, 1, -1), at + Vec3(0, 1, 1), at + Vec3(0, -1, 1)}, {}}, {});
  TetSolid solid(uneven_block(), {}, settings(uneven_block()));
  TetSprings springs(uneven_block(), {}, settings(uneven_block()));
  for (VolumeModel* model : {static_cast<VolumeModel*>(&solid), static_cast<VolumeModel*>(&springs)})
    model->change(with_fixed(volume.change()));
  volume.forget();
  std::vector<std::uint32_t> right;
  for (std::uint32_t t = 0; t < volume.tetrahedra().size(); ++t) {
    double x = 0;
    for (const VertexId v : volume.tetrahedra()[t]) x += 0.25 * volume.vertex(v).rest_body_m.x();
    if (x > at.x()) right.push_back(t);
  }
  const TetChange change = volume.remove(right);
  solid.change(change);
  springs.change(change);
  const TetMesh left = volume.mesh();
  EXPECT_TRUE(check(left).valid);
  EXPECT_NEAR(check(left).volume_m3, 0.052 * 0.01, 3e-5);
  const TetSolid anew(left, {}, settings(left));
  std::vector<Vec4f> x = test::at_rest(solid.mesh()), y = test::at_rest(left);
  std::vector<Vec3> f(x.size()), g(y.size());
  std::vector<VertexId> alive;
  for (VertexId v = 0; v < x.size(); ++v)
    if (volume.alive(v)) alive.push_back(v);
  ASSERT_EQ(alive.size(), y.size());
  for (VertexId v = 0; v < y.size(); ++v) {
    y[v].head<3>() += 0.001f * Vec3f(std::sin(float(v)), std::cos(float(v)), 0);
    x[alive[v]] = y[v];
  }
  solid.elastic_forces_n(x, f);
  anew.elastic_forces_n(y, g);
  for (VertexId v = 0; v < y.size(); ++v) ASSERT_LT((f[alive[v]] - g[v]).norm(), 1e-5) << v;
  EXPECT_NEAR(solid.elastic_energy_j(x), anew.elastic_energy_j(y), 1e-9);
  EXPECT_EQ(solid.rows().row_count(), left.vertices_body_m.size());
}

// The surface obtained from the changes is that of the volume.
TEST(Changes, the_surface_follows_from_what_has_changed) {
  Random random(5);
  TetTopology volume(uneven_block());
  const auto turned = [](std::array<VertexId, 3> t) {
    std::rotate(t.begin(), std::ranges::min_element(t), t.end());
    return t;
  };
  std::map<std::array<VertexId, 3>, int> surface;
  const TetSurface before = surface_of(uneven_block());
  for (const auto& t : before.soup.triangles)
    ++surface[turned({before.of_volume[t[0]], before.of_volume[t[1]], before.of_volume[t[2]]})];
  for (int n = 0; n < 20; ++n) {
    cut(volume, random.sheet(), {0.08, n % 2 == 1});
    const TetDelta delta = volume.take_back();
    EXPECT_TRUE(volume.change().tetrahedra.empty());
    apply(delta, volume);
    const BoundaryChange change = boundary_change(delta.tetrahedra);
    for (const auto& t : change.removed) EXPECT_EQ(--surface[turned(t)], 0);
    for (const auto& t : change.added) EXPECT_EQ(++surface[turned(t)], 1);
  }
  std::erase_if(surface, [](const auto& entry) { return entry.second == 0; });
  std::map<std::array<VertexId, 3>, int> now;
  const TetSurface after = surface_of(volume.mesh());
  for (const auto& t : after.soup.triangles)
    ++now[turned({after.of_volume[t[0]], after.of_volume[t[1]], after.of_volume[t[2]]})];
  EXPECT_EQ(surface, now);
}

}  // namespace
}  // namespace sectio::tetra_test
