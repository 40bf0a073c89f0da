// What lattice hexahedra (M4) claim, against closed forms: affine deformation, bending, torsion,
// near-incompressibility, and the opening of a crack that our own cutting engine has made.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/tet_cutting/tet_cut.h"
#include "tests/support/hex_linear.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

using test::hex_material;
using test::HexLinear;
using test::kFree;
using Points = std::vector<Vec3>;

constexpr double kYoung = 1e4;

// Cells of a box of `across` cells in y and z. The tetrahedra only say where it is.
HexLattice bar(int along, int across) {
  const TetMesh mesh = test::tet_box(along, 1, 1, Vec3(along, 1, 1));
  return lattice_of(mesh, grid_around(mesh, 1.0 / across));
}

Points all(const HexLattice& lattice, double value) {
  return Points(lattice.nodes.size(), Vec3::Constant(value));
}

// Force on the end x = side of a unit cube under an affine deformation, by the fast kernels.
struct Pull {
  Vec3 on_end = Vec3::Zero();
  double worst_inside = 0;
};
Pull pull_under(const Mat3& f, double poisson) {
  const TetMesh mesh = test::tet_box(2, 2, 2, Vec3(0.1, 0.1, 0.1));
  VolumeMaterial material;
  material.young_pa = kYoung;
  material.poisson = poisson;
  const HexSolid solid(mesh, grid_around(mesh, 0.025), material, {});
  const HexLattice& lattice = solid.lattice();
  std::vector<Vec4f> x(lattice.nodes.size(), Vec4f::Zero());
  for (std::uint32_t n = 0; n < x.size(); ++n) x[n].head<3>() = (f * lattice.rest_m(n)).cast<float>();
  Points force(x.size());
  solid.elastic_forces_n(x, force);
  Pull pull;
  for (std::uint32_t n = 0; n < x.size(); ++n) {
    const GridPlace& p = lattice.nodes[n];
    if (p[0] == 4) pull.on_end -= force[n] / 0.01;
    if (std::ranges::min(p) > 0 && std::ranges::max(p) < 4)
      pull.worst_inside = std::max(pull.worst_inside, force[n].norm() / 0.01);
  }
  return pull;
}

TEST(A_accuracy_lattice, A_1_2_3_4_affine_deformations_are_exact) {
  struct Case {
    double nu, l, stress_over_e;
  };
  for (const Case& c : {Case{0.45, 0.7, -0.432191}, Case{0.45, 1.1, 0.0917381}, Case{0.45, 1.3, 0.239527},
                        Case{0.45, 2.0, 0.599138}, Case{0.3, 1.5, 0.383191}}) {
    const double j = 1 + (1 - 2 * c.nu) * (1 - 1 / c.l), lateral = std::sqrt(j / c.l);
    const Pull pull = pull_under(Vec3(c.l, lateral, lateral).asDiagonal(), c.nu);
    EXPECT_NEAR(pull.on_end.x() / kYoung, c.stress_over_e, 1e-4) << c.nu << " " << c.l;
    EXPECT_LT(pull.worst_inside, 2e-5 * kYoung);
  }
  const double mu = kYoung / 2.9, kappa = mu + 9 * mu;
  Mat3 shear = Mat3::Identity();
  shear(1, 0) = 0.5;
  EXPECT_NEAR(pull_under(shear, 0.45).on_end.y(), 1724.14, 0.05);
  for (const double s : {0.8, 0.95, 1.1, 1.3}) {
    const double stress = mu * s + (kappa * (s * s * s - 1) - mu) * s * s;
    EXPECT_NEAR(pull_under(s * Mat3::Identity(), 0.45).on_end.x(), stress, 1e-4 * std::max(std::abs(stress), kYoung));
  }
}

// The stiffness that the following cases are computed with is that of the fast kernels.
TEST(A_accuracy_lattice, the_linear_reference_is_the_models) {
  TetMesh mesh = test::tet_box(4, 2, 2, Vec3(0.08, 0.04, 0.04));
  test::jitter(mesh, 0.002);
  VolumeMaterial material;
  material.poisson = 0.45;
  const HexSolid solid(mesh, grid_around(mesh, 0.013), material, {});
  const HexLinear linear(solid.lattice(), solid.material());
  std::vector<Vec4f> plus(solid.lattice().nodes.size(), Vec4f::Zero()), minus = plus;
  Points u(plus.size()), fp(plus.size()), fm(plus.size());
  for (std::uint32_t n = 0; n < u.size(); ++n) {
    u[n] = 1e-4 * Vec3(std::sin(3.0 * n), std::sin(5.0 * n + 1), std::sin(7.0 * n + 2));
    plus[n].head<3>() = (solid.lattice().rest_m(n) + u[n]).cast<float>();
    minus[n].head<3>() = (solid.lattice().rest_m(n) - u[n]).cast<float>();
  }
  solid.elastic_forces_n(plus, fp);
  solid.elastic_forces_n(minus, fm);
  const Points expected = linear.forces_n(u);
  double most = 0, worst = 0;
  for (std::size_t n = 0; n < u.size(); ++n) {
    most = std::max(most, expected[n].norm());
    worst = std::max(worst, (0.5 * (fm[n] - fp[n]) - expected[n]).norm());
  }
  EXPECT_LT(worst, 5e-3 * most);
}

// Tip over that of Timoshenko's beam, L / h = 8.
double cantilever_ratio(int across, double nu) {
  const HexLattice lattice = bar(8, across);
  Points given = all(lattice, kFree), load = all(lattice, 0);
  const std::vector<double> area = test::areas_m2(lattice, 0, 8 * across);
  for (std::uint32_t n = 0; n < given.size(); ++n) {
    if (lattice.nodes[n][0] == 0) given[n].setZero();
    load[n].z() = -area[n];
  }
  const Points u = HexLinear(lattice, hex_material(kYoung, nu)).displacements_m(given, load);
  double drop = 0;
  for (std::uint32_t n = 0; n < u.size(); ++n) drop -= area[n] * u[n].z();
  const double shear = kYoung / (2 * (1 + nu)), kappa = 10 * (1 + nu) / (12 + 11 * nu);
  return drop / (512 / (3 * kYoung / 12) + 8 / (kappa * shear));
}

TEST(A_accuracy_lattice, A_5_cantilever_of_two_and_four_cells_within_three_percent) {
  for (const double nu : {0.3, 0.45}) {
    EXPECT_NEAR(cantilever_ratio(2, nu), 1, 0.03) << nu;
    EXPECT_NEAR(cantilever_ratio(4, nu), 1, 0.03) << nu;
  }
}

TEST(A_accuracy_lattice, A_16_nothing_locks_as_poisson_nears_a_half) {
  for (const double nu : {0.49, 0.499}) EXPECT_GT(cantilever_ratio(4, nu), 0.93) << nu;
}

// T / T_ref of a square bar whose ends turn in their planes and may warp: T = G J phi / L, J = 0.140577 a^4.
double torsion_ratio(int across, double nu) {
  const int length = 3;
  const HexLattice lattice = bar(length, across);
  const double h = 1.0 / across, phi = 1e-3;
  Points given = all(lattice, kFree), from_axis = all(lattice, 0);
  for (std::uint32_t n = 0; n < given.size(); ++n) {
    const GridPlace& p = lattice.nodes[n];
    from_axis[n] = Vec3(0, p[1] * h - 0.5, p[2] * h - 0.5);
    if (p[0] != 0 && p[0] != length * across) continue;
    const double angle = p[0] == 0 ? 0 : phi;
    given[n] = Vec3(kFree, -angle * from_axis[n].z(), angle * from_axis[n].y());
    if (p == GridPlace{0, across / 2, across / 2}) given[n].x() = 0;
  }
  const HexLinear linear(lattice, hex_material(kYoung, nu));
  const Points force = linear.forces_n(linear.displacements_m(given, all(lattice, 0)));
  double torque = 0;
  for (std::uint32_t n = 0; n < force.size(); ++n)
    if (lattice.nodes[n][0] == length * across) torque += from_axis[n].cross(force[n]).x();
  return torque / (kYoung / (2 * (1 + nu)) * 0.140577 * phi / length);
}

TEST(A_accuracy_lattice, A_8_torsion_falls_with_the_square_of_the_cell) {
  const double four = torsion_ratio(4, 0.45), eight = torsion_ratio(8, 0.45);
  EXPECT_NEAR(four, 1, 0.16);
  EXPECT_NEAR(eight, 1, 0.04);
  EXPECT_GT(std::log2((four - 1) / (eight - 1)), 1.8);
  EXPECT_NEAR(torsion_ratio(4, 0.3), four, 0.01);
}

// Opening at the mouth of an edge crack through half of a strip under tension, plane strain, over Tada's 4 s a / E'
// V_1, V_1(1/2) = 4.92339. `shift`: by how many cells the crack lies beside the lattice's planes.
double crack_ratio(int cells_per_crack, double shift, double nu = 0.3) {
  const int half = 4;  // crack lengths from the crack to the ends
  const double h = 1.0 / cells_per_crack;
  // A strip 2 a wide, and as high; tetrahedra as large as cells, one of their planes at the crack's tip.
  const TetMesh whole = test::tet_box(2 * cells_per_crack, 1, 2 * half * cells_per_crack, Vec3(2, h, 2 * half));
  TetTopology volume(whole);
  const double at = half + shift * h;
  cut(volume, {{Vec3(-1, -1, at), Vec3(1 + 1e-6, -1, at), Vec3(1 + 1e-6, 1, at), Vec3(-1, 1, at)}}, {});
  const TetMesh mesh = volume.mesh();
  const HexLattice lattice = lattice_of(mesh, grid_around(whole, h));
  Points given = all(lattice, kFree), load = all(lattice, 0);
  const int top = 2 * half * cells_per_crack;
  const std::vector<double> up = test::areas_m2(lattice, 2, top), down = test::areas_m2(lattice, 2, 0);
  for (std::uint32_t n = 0; n < given.size(); ++n) {
    given[n].y() = 0;
    load[n].z() = up[n] - down[n];
    if (lattice.nodes[n] == GridPlace{2 * cells_per_crack, 0, top / 2}) given[n] = Vec3::Zero();
    if (lattice.nodes[n] == GridPlace{2 * cells_per_crack, 0, top}) given[n].x() = 0;
  }
  const Points u = HexLinear(lattice, hex_material(1, nu)).displacements_m(given, load);
  double highest = -1e9, lowest = 1e9;
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3& x = mesh.vertices_body_m[v];
    if (x.x() != 0 || std::abs(x.z() - at) > 1e-9) continue;
    double z = 0;
    for (std::size_t c = 0; c < 8; ++c)
      z += lattice.points[v].weight(c) * u[lattice.cells[lattice.points[v].cell].nodes[c]].z();
    highest = std::max(highest, z);
    lowest = std::min(lowest, z);
  }
  return (highest - lowest) / (4 * 4.92339 * (1 - nu * nu));
}

TEST(A_accuracy_lattice, A_12_a_crack_of_our_own_cutting_opens_as_tadas) {
  const double coarse = crack_ratio(8, 0), fine = crack_ratio(16, 0);
  EXPECT_GT(coarse, 0.9);
  EXPECT_GT(fine, 0.95);
  EXPECT_LT(fine, 1.01);
  EXPECT_GT(std::log2((1 - coarse) / (1 - fine)), 0.9);
  const double beside = crack_ratio(8, 0.5), beside_fine = crack_ratio(16, 0.5);
  EXPECT_GT(beside, 0.85);
  EXPECT_GT(beside_fine, 0.92);
}

}  // namespace
}  // namespace sectio
