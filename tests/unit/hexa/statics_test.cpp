// Bodies of tetrahedra, springs and lattices under their weight, for small strains.
#include <gtest/gtest.h>

#include "common/math/fixed_sequence.h"
#include "sim_server/deformation/hexa/hex_at_rest.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/tet_shapes.h"

namespace sectio::hexa_test {
namespace {

constexpr double kLength_m = 0.1, kGravity_m_per_s2 = 9.81;

VolumeMaterial soft(double poisson) {
  VolumeMaterial m;
  m.young_pa = 20000;
  m.poisson = poisson;
  return m;
}
TetMesh rod() {
  return test::tet_box(20, 4, 4, Vec3(kLength_m, 0.02, 0.02));
}
VolumeSettings held_at(const TetMesh& mesh, double x_m) {
  VolumeSettings settings;
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.x() < x_m + 1e-9);
  return settings;
}
// The end of a rod of so many pascals that hangs down along x: rho g L^2 / (2 E).
double sinks_m(const VolumeMaterial& m) {
  return m.density_kg_per_m3 * kGravity_m_per_s2 * kLength_m * kLength_m / (2 * m.young_pa);
}
double end_m(VolumeModel& model) {
  double furthest_m = 0;
  for (const SagPoint& p : model.sag(Vec3(kGravity_m_per_s2, 0, 0)))
    if (p.rest_m.x() > kLength_m - 1e-9) furthest_m = std::max(furthest_m, p.moved_m.x());
  return furthest_m;
}

TEST(Statics, a_rod_is_as_long_as_its_weight_makes_it) {
  const TetMesh mesh = rod();
  const VolumeSettings settings = held_at(mesh, 0);
  const VolumeMaterial cork = soft(0), tissue = soft(0.25);
  TetSolid solid(mesh, cork, settings);
  EXPECT_NEAR(end_m(solid), sinks_m(cork), 0.01 * sinks_m(cork));
  HexSolid lattice(mesh, grid_around(mesh, 0.01), cork, settings);
  EXPECT_NEAR(end_m(lattice), sinks_m(cork), 0.01 * sinks_m(cork));
  TetSprings springs(mesh, tissue, settings);
  EXPECT_NEAR(end_m(springs), sinks_m(tissue), 0.12 * sinks_m(tissue));
}

TEST(Statics, tells_of_what_is_free_alone) {
  const TetMesh mesh = rod();
  HexSolid lattice(mesh, grid_around(mesh, 0.01), soft(0.4), held_at(mesh, 0.02));
  const auto sag = lattice.sag(Vec3(0, 0, -kGravity_m_per_s2));
  ASSERT_FALSE(sag.empty());
  for (const SagPoint& p : sag) {
    EXPECT_GT(p.rest_m.x(), 0.02);
    EXPECT_GT(p.mass_kg, 0);
  }
}

TEST(Statics, nothing_is_known_of_a_body_that_nothing_holds) {
  const TetMesh mesh = rod();
  HexSolid lattice(mesh, grid_around(mesh, 0.01), soft(0.4), {});
  EXPECT_TRUE(lattice.sag(Vec3(0, 0, -kGravity_m_per_s2)).empty());
}

TEST(HexAtRest, its_product_is_that_of_the_energy) {
  const TetMesh mesh = test::tet_box(5, 3, 4, Vec3(0.051, 0.033, 0.04));  // some cells are partly empty
  const HexLattice lattice = lattice_of(mesh, grid_around(mesh, 0.0107));
  const HexMaterial material{4000, 30000, 1000};
  HexDescent energy(lattice, material);
  std::vector<Vec3> rest_m;
  for (std::uint32_t n = 0; n < lattice.nodes.size(); ++n) rest_m.push_back(lattice.rest_m(n));
  energy.linearise(rest_m);
  std::vector<Vec4f> p(rest_m.size(), Vec4f::Zero()), slow = p, fast = p;
  for (std::size_t n = 0; n < p.size(); ++n) p[n].head<3>() = fixed_vector(n).cast<float>();
  energy.add_product(p, slow);
  HexAtRest(lattice, material).add_product(p, fast);
  double wrong = 0, all = 0;
  for (std::size_t n = 0; n < p.size(); ++n) {
    wrong += double{(fast[n] - slow[n]).squaredNorm()};
    all += double{slow[n].squaredNorm()};
  }
  EXPECT_LT(std::sqrt(wrong), 1e-5 * std::sqrt(all));
}

}  // namespace
}  // namespace sectio::hexa_test
