#include "sim_server/body_contact/mass_properties.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

MassProperties of(const TriangleSoup& soup, double density_kg_per_m3) {
  const TriangleMesh mesh(soup);
  return mass_properties(mesh.rest_body_m(), mesh.triangles(), density_kg_per_m3);
}

void expect_near(const Mat3& a, const Mat3& b, double relative) {
  EXPECT_LT((a - b).norm(), relative * b.norm()) << a << "\n\n" << b;
}

TEST(MassProperties, box_far_from_the_origin) {
  TriangleSoup soup = box(3, 4, 5, Vec3(0.1, 0.2, 0.3));
  for (Vec3& p : soup.vertices_body_m) p += Vec3(10, -20, 30);
  const MassProperties m = of(soup, 1000);
  EXPECT_NEAR(m.volume_m3, 0.006, 1e-13);
  EXPECT_NEAR(m.mass_kg, 6, 1e-10);
  EXPECT_LT((m.centre_m - Vec3(10.05, -19.9, 30.15)).norm(), 1e-12);
  const Mat3 inertia = Vec3(0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04).asDiagonal() * (6.0 / 12);
  expect_near(m.inertia_kg_m2, inertia, 1e-10);
}

TEST(MassProperties, turned_box_has_the_turned_tensor) {
  const Mat3 r = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  TriangleSoup soup = box(1, 1, 1, Vec3(0.1, 0.2, 0.3));
  const Mat3 straight = of(soup, 1000).inertia_kg_m2;
  for (Vec3& p : soup.vertices_body_m) p = r * p;
  expect_near(of(soup, 1000).inertia_kg_m2, r * straight * r.transpose(), 1e-12);
}

TEST(MassProperties, tetrahedron) {
  TriangleSoup soup;
  soup.vertices_body_m = {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  soup.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const MassProperties m = of(soup, 6);
  EXPECT_NEAR(m.mass_kg, 1, 1e-14);
  EXPECT_LT((m.centre_m - Vec3::Constant(0.25)).norm(), 1e-14);
  // int x^2 = 1/10, int x y = 1/20 for unit mass about the corner; about the centre 1/10 - 1/16 and 1/20 - 1/16.
  Mat3 inertia = Mat3::Constant(0.0125);
  inertia.diagonal().setConstant(2 * 0.0375);
  expect_near(m.inertia_kg_m2, inertia, 1e-13);
}

TEST(MassProperties, ball_converges_with_the_square_of_the_edge) {
  const auto error = [](int levels) {
    const MassProperties m = of(ellipsoid(levels, Vec3::Constant(0.5)), 1000);
    const double mass = 1000 * 4 / 3.0 * M_PI * 0.125;
    EXPECT_LT((m.inertia_kg_m2 / m.mass_kg - Mat3::Identity() * 0.1).norm(), 0.1);
    return std::abs(m.mass_kg / mass - 1);
  };
  EXPECT_LT(error(4), 0.01);
  EXPECT_NEAR(error(3) / error(4), 4, 0.2);
}

TEST(MassProperties, inside_out_has_no_mass) {
  TriangleSoup soup = box(1, 1, 1, Vec3::Ones());
  for (auto& t : soup.triangles) std::swap(t[0], t[1]);
  const MassProperties m = of(soup, 1000);
  EXPECT_NEAR(m.volume_m3, -1, 1e-14);
  EXPECT_EQ(m.mass_kg, 0);
}

}  // namespace
}  // namespace sectio::test
