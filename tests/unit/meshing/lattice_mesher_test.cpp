#include "sim_server/meshing/lattice_mesher.h"

#include <gtest/gtest.h>

#include <random>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/relax.h"
#include "sim_server/meshing/tetgen.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"
#include "tests/support/tet_shapes.h"

namespace sectio::meshing_test {
namespace {

double mean_distance_to_ellipsoid(const TetMesh& mesh, const Vec3& half_axes_m) {
  const TetSurface outside = surface_of(mesh);
  double sum = 0;
  for (const Vec3& x : outside.soup.vertices_body_m) sum += std::abs(x.cwiseQuotient(half_axes_m).norm() - 1);
  return sum / static_cast<double>(outside.soup.vertices_body_m.size());
}

TEST(C_IMP, C_IMP_1_any_closed_surface_is_filled) {
  const TriangleSoup organ = test::ellipsoid(4, Vec3(0.09, 0.06, 0.05));
  const FilledVolume filled = fill(organ, {Mesher::lattice, 3000, {}, 60});
  EXPECT_TRUE(filled.report.tets.valid) << filled.report.tets.first_defect;
  EXPECT_EQ(filled.report.tets.components, 1u);
  EXPECT_NEAR(filled.report.tets.tetrahedra, 3000, 900);
  EXPECT_GT(filled.report.tets.smallest_dihedral_deg, 12);
  EXPECT_NEAR(filled.report.tets.volume_m3 / filled.report.surface_volume_m3, 1, 0.03);
  EXPECT_LT(mean_distance_to_ellipsoid(filled.mesh, Vec3(0.09, 0.06, 0.05)), 0.005);
}

TEST(C_IMP, C_IMP_1_a_hole_through_the_organ_stays) {
  const FilledVolume filled = fill(test::torus(60, 24, 0.05, 0.02), {Mesher::lattice, 4000, {}, 60});
  EXPECT_EQ(check_soup(surface_of(filled.mesh).soup).euler_characteristic, 0);
}

TEST(C_IMP, C_IMP_1_two_parts_stay_two_and_a_cavity_stays_empty) {
  TriangleSoup both = test::ellipsoid(3, Vec3(0.05, 0.05, 0.05));
  const auto add = [&](TriangleSoup part, const Vec3& at, bool inside_out) {
    const auto first = static_cast<VertexId>(both.vertices_body_m.size());
    for (const Vec3& p : part.vertices_body_m) both.vertices_body_m.push_back(p + at);
    for (auto t : part.triangles) {
      if (inside_out) std::swap(t[1], t[2]);
      both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  };
  add(test::ellipsoid(3, Vec3(0.02, 0.02, 0.02)), Vec3::Zero(), true);
  add(test::ellipsoid(3, Vec3(0.02, 0.02, 0.02)), Vec3(0.1, 0, 0), false);
  const FilledVolume filled = fill(both, {Mesher::lattice, 9000, {}, 60});
  EXPECT_EQ(filled.report.tets.components, 2u);
  EXPECT_EQ(check_soup(surface_of(filled.mesh).soup).components, 3u);
}

TEST(C_IMP, C_IMP_1_unusable_surfaces_are_refused_with_the_reason) {
  const auto reason = [](const TriangleSoup& surface) -> std::string {
    try {
      fill(surface, {});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  TriangleSoup open = test::box(2, 2, 2, Vec3(0.1, 0.1, 0.1));
  open.triangles.pop_back();
  EXPECT_NE(reason(open).find("can't be filled"), std::string::npos);
  TriangleSoup inverted = test::box(2, 2, 2, Vec3(0.1, 0.1, 0.1));
  for (auto& t : inverted.triangles) std::swap(t[1], t[2]);
  EXPECT_NE(reason(inverted).find("inside out"), std::string::npos);
}

// A mesh of whole cells would have steps here.
TEST(LatticeMesher, boundary_vertices_lie_on_the_surface) {
  const TetMesh mesh = fill_with_lattice(test::box(4, 4, 4, Vec3(0.1, 0.1, 0.1)), 0.021);
  for (const Vec3& p : surface_of(mesh).soup.vertices_body_m) {
    const double to_face = std::min(p.minCoeff(), (Vec3::Constant(0.1) - p).minCoeff());
    EXPECT_NEAR(to_face, 0, 1e-12);
  }
}

TriangleSoup turned(TriangleSoup soup, const Eigen::Quaterniond& by) {
  for (Vec3& p : soup.vertices_body_m) p = by * p;
  return soup;
}

TEST(LatticeMesher, sharp_edges_and_corners_of_boxes_stay_however_they_are_turned) {
  test::Random random(3);
  std::normal_distribution<double> normal;
  const Vec3 size_m(0.2, 0.05, 0.07);
  int corners = 0;
  for (int pose = 0; pose < 8; ++pose) {
    const Eigen::Quaterniond by =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
    const TetMesh mesh = fill_with_lattice(turned(test::box(4, 2, 2, size_m), by), 0.02);
    EXPECT_NEAR(check(mesh).volume_m3 / size_m.prod(), 1, 0.004);  // 0.97 when edges are cut off
    const TetSurface outside = surface_of(mesh);
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 at = by * Vec3((corner & 1) * size_m.x(), (corner >> 1 & 1) * size_m.y(), (corner >> 2) * size_m.z());
      double nearest_m = 1;
      for (const Vec3& p : outside.soup.vertices_body_m) nearest_m = std::min(nearest_m, (p - at).norm());
      corners += nearest_m < 1e-9;
    }
  }
  // Now and then a corner has no place: the tetrahedra there would be too flat.
  EXPECT_GE(corners, 58) << "of 64";
}

TEST(LatticeMesher, a_notch_stays_sharp) {
  // A groove along the whole length of a box, whose bottom is a crease that points inwards.
  TriangleSoup notched = test::box(8, 8, 8, Vec3(0.1, 0.1, 0.1));
  for (Vec3& p : notched.vertices_body_m)
    if (p.z() > 0.099) p.z() -= 0.03 * (1 - std::abs(p.y() - 0.05) / 0.05);
  const SurfaceReport given = check_soup(notched);
  ASSERT_TRUE(given.valid());
  const TetMesh mesh = fill_with_lattice(turned(notched, Eigen::Quaterniond(0.9, 0.1, 0.3, 0.2).normalized()), 0.017);
  EXPECT_NEAR(check(mesh).volume_m3 / given.volume_m3, 1, 0.013);  // its rims are acute: some stay cut off
}

TEST(LatticeMesher, a_smooth_organ_has_no_creases_and_a_box_has_twelve) {
  EXPECT_TRUE(SurfaceCreases(test::ellipsoid(3, Vec3(0.09, 0.06, 0.05)), 0.02).empty());
  const TriangleSoup box = test::box(3, 3, 3, Vec3(0.1, 0.1, 0.1));
  const SurfaceCreases creases(box, 0.02);
  EXPECT_EQ(creases.seat_of(Vec3(0.04, 0.03, 0)).size(), 1u);
  EXPECT_EQ(creases.seat_of(Vec3(0.04, 0, 0)).size(), 2u);
  EXPECT_EQ(creases.seat_of(Vec3(0.1, 0, 0)).size(), 3u);
  const auto corner = creases.between(Vec3(0.09, 0.002, 0), creases.seat_of(Vec3(0.09, 0.002, 0)),
                                      Vec3(0.1, 0.001, 0.001), creases.seat_of(Vec3(0.1, 0.001, 0.001)));
  ASSERT_TRUE(corner);
  EXPECT_NEAR((corner->point - Vec3(0.1, 0.001, 0)).norm(), 0, 0.002);
  // A face that the cells can't follow counts for nothing.
  EXPECT_TRUE(SurfaceCreases(test::box(1, 1, 1, Vec3(0.01, 0.01, 0.01)), 0.02).empty());
}

TEST(LatticeMesher, all_is_the_same_each_time) {
  const TriangleSoup organ = test::ellipsoid(4, Vec3(0.09, 0.06, 0.05));
  const TetMesh once = fill_with_lattice(organ, 0.02), again = fill_with_lattice(organ, 0.02);
  EXPECT_EQ(once.tetrahedra, again.tetrahedra);
  EXPECT_EQ(once.vertices_body_m, again.vertices_body_m);
}

TEST(LatticeMesher, it_is_settled_and_settling_enlarges_the_step) {
  const TriangleSoup organ = test::ellipsoid(4, Vec3(0.09, 0.06, 0.05));
  TetMesh mesh = fill_with_lattice(organ, 0.02);
  const double best_s = explicit_step_limit_s(mesh, {});
  const SurfaceCreases creases(organ, 0.02);
  relax(mesh, creases, {}, {}, 2);
  EXPECT_LT(explicit_step_limit_s(mesh, {}), 1.1 * best_s);
  const TetMesh settled = mesh;
  test::jitter(mesh, 0.002);
  const double shaken_s = explicit_step_limit_s(mesh, {});
  relax(mesh, creases, {});
  EXPECT_GT(explicit_step_limit_s(mesh, {}), 1.1 * shaken_s);
  EXPECT_TRUE(check(mesh).valid);
  EXPECT_EQ(mesh.tetrahedra, settled.tetrahedra);
}

TEST(LatticeMesher, relaxes_where_it_is_asked_to) {
  const TriangleSoup organ = test::ellipsoid(4, Vec3(0.09, 0.06, 0.05));
  const TetMesh all = fill_with_lattice(organ, 0.02),
                none = fill_with_lattice(organ, 0.02, [](const Vec3&) { return false; }),
                half = fill_with_lattice(organ, 0.02, [](const Vec3&p) { return p.x() > 0; });
  EXPECT_EQ(all.tetrahedra, half.tetrahedra);
  int moved = 0;
  for (VertexId v = 0; v < half.vertices_body_m.size(); ++v) {
    const bool is_moved = half.vertices_body_m[v] != none.vertices_body_m[v];
    moved += is_moved;
    EXPECT_FALSE(is_moved && none.vertices_body_m[v].x() <= 0);
  }
  EXPECT_GT(moved, 20);
}

TEST(LatticeMesher, the_step_limit_is_that_of_a_known_element) {
  // One regular tetrahedron: the volume mode alone has lambda_max = 4 (lambda + 2 mu / 3) sum |g|^2 / (3 rho) here.
  TetMesh mesh;
  mesh.vertices_body_m = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  if (tet_volume_m3(mesh, mesh.tetrahedra[0]) < 0) std::swap(mesh.tetrahedra[0][2], mesh.tetrahedra[0][3]);
  const ElasticMaterial m{1000, 0.45, 1000};
  const double mu = m.young_pa / (2 * 1.45), bulk = m.young_pa / (3 * 0.1);
  // u = x: strain the unit matrix, stress 3 K, force V 3 K g_i, |x_i| = sqrt 3, g_i = x_i / 4, mass rho V / 4.
  const double omega2 = 3 * bulk * 4 / (4 * m.density_kg_per_m3);
  ASSERT_GT(omega2, 2 * mu * 4 / (4 * m.density_kg_per_m3));
  EXPECT_NEAR(explicit_step_limit_s(mesh, m), 2 / std::sqrt(omega2), 1e-6);
}

TEST(Tetgen, runs_as_a_program_with_a_time_limit) {
  if (!tetgen_installed()) GTEST_SKIP() << "tetgen is not installed";
  const TriangleSoup organ = test::ellipsoid(3, Vec3(0.09, 0.06, 0.05));
  const FilledVolume filled = fill(organ, {Mesher::best, 3000, {}, 60});
  ASSERT_EQ(filled.compared.size(), 2u) << (filled.notes.empty() ? "" : filled.notes[0]);
  EXPECT_EQ(filled.report.stable_step_s, std::max(filled.compared[0].stable_step_s, filled.compared[1].stable_step_s));
  EXPECT_NEAR(filled.compared[1].tets.volume_m3 / filled.report.surface_volume_m3, 1, 1e-6);
  EXPECT_LT(mean_distance_to_ellipsoid(filled.mesh, Vec3(0.09, 0.06, 0.05)), 0.005);
  EXPECT_THROW(fill_with_tetgen(organ, 1e-10, 0), InputError);
}

}  // namespace
}  // namespace sectio::meshing_test
