// A storm of random cuts of a body of lattice hexahedra while it moves: the step that was stable stays so without any
// mass, the fills add up, a cut does nothing to momentum and energy, and energy only falls.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/random.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

class HexStorm : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, HexStorm, testing::Range(0u, 12u));

TEST_P(HexStorm, S_6_the_stable_step_is_the_same_before_and_after) {
  test::Random random(GetParam());
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.08, 0.08, 0.08));
  test::jitter(mesh, 0.002);
  TetTopology volume(mesh);
  VolumeSettings settings;
  const auto is_fixed = [](const Vec3& p) { return p.z() < 0.005; };
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(is_fixed(p));
  HexSolid solid(mesh, grid_around(mesh, 0.0131), {}, settings);
  const double limit_s = solid.explicit_limit_s(), cells_m3 = std::pow(0.0131, 3), whole_m3 = check(mesh).volume_m3;
  test::Points x = test::at_rest(mesh), v = test::still(x);
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (std::size_t n = 0; n < solid.node_mass_kg().size(); ++n)
      sum += solid.node_mass_kg()[n] * solid.node_velocity_m_per_s()[n].head<3>().cast<double>();
    return sum;
  };
  const auto live = [&] {
    for (int n = 0; n < 25; ++n) solid.step(x, v, {}, {});
  };
  // Tissue that is held at all its corners is in no cell.
  const auto loose = [&] {
    const auto is_held = [&](VertexId corner) { return is_fixed(volume.vertex(corner).rest_body_m); };
    double sum_m3 = 0;
    for (std::uint32_t t = 0; t < volume.tetrahedra().size(); ++t)
      if (const Tetrahedron& tet = volume.tetrahedra()[t]; tet != kNoTetrahedron && !std::ranges::all_of(tet, is_held))
        sum_m3 += volume.volume_m3(t);
    return sum_m3;
  };
  constexpr double kFast_m_per_s = 0.1;
  live();
  double least_fill = 1, loose_m3 = loose();
  int jumps = 0;
  for (int n = 0; n < 15; ++n) {
    const Vec3 at = Vec3::Constant(0.04) + 0.035 * vector(), normal = vector().normalized();
    const double size = n % 3 == 0 ? 1 : 0.01 + 0.03 * std::abs(uniform(random));
    const Vec3 u = size * normal.unitOrthogonal(), w = size * normal.cross(normal.unitOrthogonal());
    cut(volume, {{at - u - w, at + u - w, at + u + w, at - u + w}}, {});
    TetChange change = volume.change();
    volume.forget();
    for (const Vec3& p : change.added_body_m) change.fixed.push_back(is_fixed(p));
    const Vec3 before = momentum();
    const double energy_j = solid.energy_j({}, {}), size_j = 1060 * whole_m3 * 9.81 * 0.08;
    solid.change(change);
    const double now_held_m3 = loose_m3 - loose();
    loose_m3 -= now_held_m3;
    EXPECT_LT((momentum() - before).norm(), 1060 * (1e-6 * whole_m3 + kFast_m_per_s * now_held_m3));
    // Copies have the deformation at the centroids of their own material: equal energy in uniform strain only.
    jumps += std::abs(solid.energy_j({}, {}) - energy_j) > 0.02 * size_j;
    EXPECT_EQ(solid.explicit_limit_s(), limit_s);
    double filled_m3 = 0;
    for (const HexCell& cell : solid.lattice().cells) {
      filled_m3 += cell.fill * cells_m3;
      least_fill = std::min(least_fill, cell.fill);
    }
    EXPECT_NEAR(filled_m3, loose_m3, 1e-7 * whole_m3);
    x.resize(volume.vertex_count(), Vec4f::Zero());
    v.resize(volume.vertex_count(), Vec4f::Zero());
    live();
    ASSERT_EQ(solid.first_bad_vertex(), kNone);
    EXPECT_LT(solid.energy_j({}, {}), energy_j + 1e-3 * size_j) << n;
  }
  EXPECT_EQ(solid.explicit_limit_s(), limit_s);
  EXPECT_LT(least_fill, 0.01);
  EXPECT_LE(jumps, 1);
  EXPECT_LT(solid.diagnostics().added_mass_fraction, 0.15);  // 15 cuts in 260 cells
}

}  // namespace
}  // namespace sectio
