// Cracks that our own cutting engine has made open as the closed forms say.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/moving_body.h"
#include "tests/support/static_body.h"

namespace sectio::cracks_test {
namespace {

using test::MovingModel;
using test::StaticBody;
using test::StaticModel;
using Points = std::vector<Vec3>;

TetMesh cut_along(const TetMesh& whole, const std::vector<Vec3>& outline) {
  TetTopology volume(whole);
  EXPECT_GT(cut(volume, {outline}, {}).twins, 0u);
  return volume.mesh();
}
// A tension of 1 Pa along z on the faces z = 0 and z = height.
Points tension_n(const TetMesh& mesh, double height) {
  const auto up = test::areas_of_vertices_m2(mesh, [&](const Vec3& p) { return p.z() > height - 1e-9; });
  const auto down = test::areas_of_vertices_m2(mesh, [](const Vec3& p) { return p.z() < 1e-9; });
  Points load(up.size(), Vec3::Zero());
  for (std::size_t v = 0; v < load.size(); ++v) load[v].z() = up[v] - down[v];
  return load;
}
constexpr double kYoung = 1e6;  // opens so little that all is linear

// Opening at the mouth of an edge crack through half of a strip under tension, plane strain, over Tada's 4 s a / E'
// V_1, V_1(1/2) = 4.92339. `shift`: by how many cells the crack lies beside the planes of the mesh.
double edge_crack_ratio(const StaticModel& model, int cells_per_crack, double shift, double poisson) {
  const int half = 4;  // crack lengths from the crack to the ends
  const double h = 1.0 / cells_per_crack, at = half + shift * h;
  const TetMesh whole =
      test::tet_box(2 * cells_per_crack, 1, 2 * half * cells_per_crack, Vec3(2, h, 2 * half), model.lattice);
  const TetMesh mesh =
      cut_along(whole, {Vec3(-1, -1, at), Vec3(1 + 1e-6, -1, at), Vec3(1 + 1e-6, 1, at), Vec3(-1, 1, at)});
  const StaticBody body = model.make(whole, mesh, h, kYoung, poisson);
  std::vector<std::uint8_t> held;
  for (const Vec3& p : body.rest_m) {
    held.push_back(test::kHeldY);
    if ((p - Vec3(2, p.y(), half)).norm() < 1e-9) held.back() = test::kHeldAll;
    if ((p - Vec3(2, p.y(), 2 * half)).norm() < 1e-9) held.back() |= test::kHeldX;
  }
  const Points x = body.equilibrium(body.rest_m, held, body.on_particles(tension_n(mesh, 2 * half)), 1e-9);
  double highest = -1e9, lowest = 1e9;
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3& p = mesh.vertices_body_m[v];
    if (p.x() != 0 || std::abs(p.z() - at) > 1e-9) continue;
    highest = std::max(highest, body.displacement_m(v, x).z());
    lowest = std::min(lowest, body.displacement_m(v, x).z());
  }
  return (highest - lowest) / (4 * 4.92339 * (1 - poisson * poisson) / kYoung);
}

TEST(Accuracy, A_12_an_edge_crack_opens_as_tadas) {
  struct Case {
    StaticModel model;
    int cells;
    double shift, at_least;
  };
  for (const Case& c : {Case{test::neo_hookean(), 4, 0, 0.8},
                        {test::neo_hookean(), 8, 0, 0.89},
                        {test::neo_hookean(), 8, 0.5, 0.89},
                        {test::neo_hookean_lattice(), 8, 0.5, 0.85},
                        {test::neo_hookean_lattice(), 16, 0.5, 0.92}}) {
    const double ratio = edge_crack_ratio(c.model, c.cells, c.shift, 0.3);
    EXPECT_GT(ratio, c.at_least) << c.model << " " << c.cells << " " << c.shift;
    EXPECT_LT(ratio, 1.01) << c.model << " " << c.cells << " " << c.shift;
  }
  const double coarse = edge_crack_ratio(test::neo_hookean_lattice(), 8, 0, 0.3),
               fine = edge_crack_ratio(test::neo_hookean_lattice(), 16, 0, 0.3);
  EXPECT_GT(coarse, 0.92);
  EXPECT_GT(fine, 0.95);
  EXPECT_LT(fine, 1.01);
  EXPECT_GT(std::log2((1 - coarse) / (1 - fine)), 0.9);
}

// At least as close as conforming tetrahedra of the same spacing, wherever the cut lies among the cells.
TEST(Accuracy, A_12_hexahedra_open_as_far_as_tetrahedra) {
  for (const int cells : {4, 8}) {
    const auto missing = [&](const StaticModel& model, double shift) {
      return std::abs(1 - edge_crack_ratio(model, cells, shift, 0.3));
    };
    EXPECT_LT(missing(test::neo_hookean_lattice(), 0), missing(test::neo_hookean(), 0)) << cells;
    EXPECT_LT(missing(test::neo_hookean_lattice(), 0.5), 1.05 * missing(test::neo_hookean(), 0.5)) << cells;
  }
}

// Second neighbours reach around the tip, so that the crack is one or two edges shorter.
TEST(Accuracy, A_12_known_failure_springs_open_too_little) {
  EXPECT_NEAR(edge_crack_ratio(test::tetra_springs(), 8, 0.5, 0.25), 0.68, 0.03);
}

// A crack of the form of a penny in the middle of a block five times as wide, under every model's own driver: the
// volume between its faces over Sneddon's 16 (1 - nu^2) s a^3 / 3 E, and the opening at the centre over 8 (1 - nu^2) s
// a / (pi E). When faces of the mesh are cut, the crack is as large as these are: a is of its area.
struct Penny {
  double volume, centre;
};
Penny penny_ratio(const MovingModel& model, int n, double beside, double poisson) {
  const double young_pa = 1e4;
  const double a_m = 0.01, side_m = 5 * a_m, middle_m = 2.5 * a_m + beside * a_m / n, strain = 0.005;
  const TetMesh whole = test::tet_box(5 * n, 5 * n, 5 * n, Vec3::Constant(side_m));
  std::vector<Vec3> outline;
  for (int i = 0; i < 32; ++i) {
    const double angle = 2 * M_PI * (i + 0.5) / 32;
    outline.push_back(Vec3(2.5 * a_m + a_m * std::cos(angle), 2.5 * a_m + a_m * std::sin(angle), middle_m));
  }
  TetTopology volume(whole);
  EXPECT_GT(cut(volume, {outline}, {}).twins, 0u);
  const TetMesh mesh = volume.mesh();
  // The slowest motion is along z: omega = pi / 2 sqrt(E / rho) / L of a bar held at one end.
  const double omega = M_PI / 2 * std::sqrt(young_pa / 1000) / side_m;
  VolumeSettings settings;
  settings.step_s = 0.0005;
  settings.gravity_m_per_s2.setZero();
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.z() < 1e-9);
  settings.least_substep_s = 5e-5;
  test::MovingBody body = model.make(mesh, a_m / n, {{young_pa, poisson, 1000}, 1.5 * omega, {}}, settings);
  const auto top = test::areas_of_vertices_m2(mesh, [&](const Vec3& p) { return p.z() > side_m - 1e-9; });
  std::vector<PointConstraint> load;
  for (VertexId v = 0; v < top.size(); ++v)
    if (top[v] > 0) load.push_back(test::dead_load(v, Vec3(0, 0, strain * young_pa * top[v])));
  body.step(static_cast<int>(6 / omega / settings.step_s), load);
  // Faces of the crack: of the surface, inside.
  double opened_m3 = 0, area_m2 = 0, highest = -1, lowest = 1;
  const TetSurface outside = surface_of(mesh);
  const auto& rest = outside.soup.vertices_body_m;
  for (const auto& t : outside.soup.triangles) {
    const auto inside = [&](VertexId v) { return rest[v].minCoeff() > 1e-9 && rest[v].maxCoeff() < side_m - 1e-9; };
    if (!inside(t[0]) || !inside(t[1]) || !inside(t[2])) continue;
    const Vec3 normal = (rest[t[1]] - rest[t[0]]).cross(rest[t[2]] - rest[t[0]]);
    area_m2 += 0.25 * normal.norm();
    for (const VertexId v : t) {
      const Vec3 u = body.x[outside.of_volume[v]].head<3>().cast<double>() - rest[v];
      opened_m3 -= normal.dot(u) / 6;
      if ((rest[v] - Vec3(2.5 * a_m, 2.5 * a_m, middle_m)).norm() > 0.3 * a_m / n) continue;
      highest = std::max(highest, u.z());
      lowest = std::min(lowest, u.z());
    }
  }
  const double scale = strain * (1 - poisson * poisson), a = std::sqrt(area_m2 / M_PI);
  return {opened_m3 / (16.0 / 3 * scale * a * a * a), (highest - lowest) / (8 / M_PI * scale * a)};
}

TEST(Accuracy, A_13_a_penny_opens_as_sneddons) {
  for (const MovingModel& model : {test::moving_tetrahedra(), test::moving_hexahedra()}) {
    const Penny penny = penny_ratio(model, 4, 0, 0.3);
    EXPECT_NEAR(penny.centre, 1, 0.06) << model;
    // The mesh makes its edge jagged, and there it is closed.
    EXPECT_NEAR(penny.volume, 0.8, 0.06) << model;
  }
}

TEST(Accuracy, A_13_known_failure_through_cells_the_edge_of_a_penny_is_closed) {
  const Penny penny = penny_ratio(test::moving_hexahedra(), 4, 0.5, 0.3);
  EXPECT_NEAR(penny.centre, 0.95, 0.05);
  EXPECT_NEAR(penny.volume, 0.6, 0.05);
}

TEST(Accuracy, A_13_known_failure_springs_open_too_little) {
  EXPECT_NEAR(penny_ratio(test::moving_springs(), 4, 0, 0.25).centre, 0.86, 0.05);
}

}  // namespace
}  // namespace sectio::cracks_test
