// The step that was stable before a cut is stable after it: small elements get added mass, and the step stays.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/random.h"
#include "tests/support/tet_shapes.h"

namespace sectio::tetra_test {
namespace {

TetMesh cut_block(std::uint32_t seed, int cuts) {
  test::Random random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  TetTopology volume(test::tet_box(5, 5, 5, Vec3(0.1, 0.1, 0.1)));
  for (int n = 0; n < cuts; ++n) {
    const Vec3 at = Vec3(0.05, 0.05, 0.05) + 0.04 * vector(), normal = vector().normalized();
    const Vec3 u = 0.04 * normal.unitOrthogonal(), w = 0.04 * normal.cross(normal.unitOrthogonal());
    cut(volume, {{at - u - w, at + u - w, at + u + w, at - u + w}, {}}, {});
  }
  return volume.mesh();
}

VolumeSettings standing(const TetMesh& mesh, double least_substep_s) {
  VolumeSettings settings;
  settings.least_substep_s = least_substep_s;
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.z() < 1e-6);
  return settings;
}

// Checks that the body is at rest on its base 0.2 s later, that nothing is faster than in free fall, and that no energy
// has come.
template <class Model>
void expect_alive(Model& model, const TetMesh& mesh) {
  std::vector<Vec4f> x(mesh.vertices_body_m.size(), Vec4f::Zero()), v = x;
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = mesh.vertices_body_m[i].cast<float>();
  const double begun_j = model.energy_j(x, v);  // with that of its height
  for (int n = 0; n < 200; ++n) model.step(x, v, {}, {});
  EXPECT_EQ(model.first_bad_vertex(), kNone);
  for (const Vec4f& u : v) EXPECT_LT(u.head<3>().norm(), 9.81 * 0.2);
  EXPECT_LT(model.energy_j(x, v), begun_j);
  EXPECT_LT(model.elastic_energy_j(x), test::bound(10, 15) * 1e-3 * 6000 * 0.1 * 0.1 * 0.1);
}

TEST(AfterCuts, the_solid_keeps_its_step_with_little_mass_added) {
  const TetSolid whole(cut_block(0, 0), {}, standing(cut_block(0, 0), 0));
  const double part_s = 0.001 / whole.substeps();
  int kept = 0;
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    const TetMesh mesh = cut_block(seed, 2);
    const TetSolid light(mesh, {}, standing(mesh, 0));
    TetSolid solid(mesh, {}, standing(mesh, part_s));
    EXPECT_GT(light.substeps(), solid.substeps()) << seed;
    kept += solid.substeps() == whole.substeps();
    EXPECT_LE(solid.substeps(), 2 * whole.substeps()) << seed;
    EXPECT_LT(solid.diagnostics().added_mass_fraction, 0.2) << seed;
    expect_alive(solid, mesh);
  }
  EXPECT_GE(kept,
            test::bound(6, 5));  // the step is divided where two cuts leave more small elements than mass may help
}

TEST(AfterCuts, springs_keep_their_step_too) {
  const TetSprings whole(cut_block(0, 0), {}, standing(cut_block(0, 0), 0));
  const double part_s = 0.001 / whole.substeps();
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    const TetMesh mesh = cut_block(seed, 2);
    TetSprings springs(mesh, {}, standing(mesh, part_s));
    EXPECT_EQ(springs.substeps(), whole.substeps()) << seed;
    EXPECT_LT(springs.diagnostics().added_mass_fraction, 0.3) << seed;
    expect_alive(springs, mesh);
  }
}

// If all cuts together would need more mass than a body is given, the substeps get shorter, but not as short as the
// lightest vertex alone would have them.
template <class Model>
void expect_few_substeps(const char* name) {
  const Model whole(cut_block(0, 0), {}, standing(cut_block(0, 0), 0));
  for (std::uint32_t seed = 0; seed < 4; ++seed) {
    const TetMesh mesh = cut_block(seed, 6);
    const Model light(mesh, {}, standing(mesh, 0));
    Model model(mesh, {}, standing(mesh, 0.001 / whole.substeps()));
    EXPECT_LE(model.diagnostics().added_mass_fraction, kMuchAddedMass) << name << ", " << seed;
    EXPECT_LE(model.substeps(), 9 * whole.substeps()) << name << ", " << seed;
    EXPECT_LT(model.substeps(), light.substeps()) << name << ", " << seed;
    expect_alive(model, mesh);
  }
}

TEST(AfterCuts, many_small_elements_shorten_the_step_a_little) {
  expect_few_substeps<TetSolid>("solid");
  expect_few_substeps<TetSprings>("springs");
}

}  // namespace
}  // namespace sectio::tetra_test
