// Regions inside a body from surfaces of a file: as few ellipsoids as do.
#include "sim_server/wrap/fit_ellipsoids.h"

#include <gtest/gtest.h>

#include "common/core/error.h"
#include "tests/support/shapes.h"

namespace sectio::wrap_test {
namespace {

TriangleSoup ellipsoid_at(const Vec3& at_m, const Vec3& radii_m, const Eigen::Quaterniond& turn) {
  TriangleSoup soup = test::ellipsoid(4, radii_m);
  for (Vec3& p : soup.vertices_body_m) p = turn * p + at_m;
  return soup;
}

TEST(FitEllipsoids, an_ellipsoid_is_itself) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  const Vec3 radii_m(0.004, 0.007, 0.012);
  const EllipsoidFit fit = fit_ellipsoids(ellipsoid_at(Vec3(0.1, 0.2, 0.3), radii_m, turn), 8);
  ASSERT_EQ(fit.ellipsoids.size(), 1u);
  EXPECT_GT(fit.overlap, 0.95);
  const Ellipsoid& e = fit.ellipsoids[0];
  EXPECT_LT((e.centre_m - Vec3(0.1, 0.2, 0.3)).norm(), 2e-4);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(e.radii_m[i] / radii_m[i], 1, 0.03);
    const Vec3 axis = e.orientation * Vec3::Unit(i);
    EXPECT_GT(std::abs(axis.dot(turn * Vec3::Unit(i))), 0.99);
  }
  EXPECT_NEAR(fit.volume_m3 / (4.0 / 3 * M_PI * radii_m.prod()), 1, 0.03);
}

TEST(FitEllipsoids, parts_that_are_apart_have_one_each) {
  const TriangleSoup one = ellipsoid_at(Vec3::Zero(), Vec3::Constant(0.006), Eigen::Quaterniond::Identity());
  const TriangleSoup other = ellipsoid_at(Vec3(0.03, 0, 0), Vec3(0.004, 0.004, 0.009), Eigen::Quaterniond::Identity());
  const EllipsoidFit fit = fit_ellipsoids(test::joined(one, other), 8);
  EXPECT_EQ(fit.ellipsoids.size(), 2u);
  EXPECT_GT(fit.overlap, 0.9);
}

TEST(FitEllipsoids, more_are_taken_where_one_does_not_do_and_never_too_many) {
  const TriangleSoup rod = test::ellipsoid(4, Vec3(0.003, 0.003, 0.003));
  TriangleSoup ring;  // balls
  for (int k = 0; k < 24; ++k) {
    const double angle = 2 * M_PI * k / 24;
    ring = test::joined(std::move(ring), test::moved(rod, 0.012 * Vec3(std::cos(angle), std::sin(angle), 0)));
  }
  const EllipsoidFit one = fit_ellipsoids(ring, 1), many = fit_ellipsoids(ring, 12);
  EXPECT_EQ(one.ellipsoids.size(), 1u);
  EXPECT_LE(many.ellipsoids.size(), 12u);
  EXPECT_LT(one.overlap, 0.75);
  EXPECT_GT(many.overlap, 0.85);
}

TEST(FitEllipsoids, refuses_what_encloses_nothing) {
  TriangleSoup sheet;
  sheet.vertices_body_m = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}};
  sheet.triangles = {{0, 1, 2}};
  EXPECT_THROW(fit_ellipsoids(sheet, 4), InputError);
  EXPECT_THROW(fit_ellipsoids({}, 4), InputError);
}

}  // namespace
}  // namespace sectio::wrap_test
