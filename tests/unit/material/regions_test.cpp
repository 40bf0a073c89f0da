#include "common/material/regions.h"

#include <gtest/gtest.h>

#include <random>

#include "common/material/region_volumes.h"
#include "common/mesh/check.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"
#include "tests/support/tet_shapes.h"

namespace sectio::material_test {
namespace {

constexpr double kPi = 3.14159265358979;

Region ball(const std::string& name, const Vec3& centre_m, double radius_m) {
  Region region;
  region.name = name;
  region.parts = {{RegionForm::ellipsoid, centre_m, Vec3::Constant(radius_m)}};
  return region;
}

// A marked tumour and, on top of it, a vessel through it.
Regions tumour_and_vessel() {
  Regions regions{ball("tumour", Vec3(0.02, 0.02, 0.02), 0.012), ball("vessel", Vec3::Zero(), 1)};
  regions[0].marked = true;
  regions[0].stiffness_factor = 5;
  regions[1].parts = {{RegionForm::tube, Vec3(-0.1, 0.02, 0.02), Vec3(0.1, 0.02, 0.02), 0.003, 0.003}};
  return regions;
}

TEST(Regions, the_later_one_is_there) {
  const Regions regions = tumour_and_vessel();
  EXPECT_EQ(region_at(regions, Vec3(0.02, 0.02, 0.02)), 1u);
  EXPECT_EQ(region_at(regions, Vec3(0.02, 0.02, 0.028)), 0u);
  EXPECT_EQ(region_at(regions, Vec3(0.02, 0.02, 0.033)), kNoRegion);
  EXPECT_EQ(stiffness_factor_at(regions, Vec3(0.02, 0.02, 0.028)), 5);
  EXPECT_EQ(stiffness_factor_at(regions, Vec3(0.02, 0.02, 0.033)), 1);
}

TEST(Regions, forms_end_where_they_should) {
  RegionPart part;
  part.a_m = Vec3(1, 2, 3);
  part.b_m = Vec3(0.3, 0.2, 0.1);
  part.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()));  // its x is the world's y
  for (const RegionForm form : {RegionForm::ellipsoid, RegionForm::box}) {
    part.form = form;
    EXPECT_NEAR(signed_distance_m(part, part.a_m + Vec3(0, 0.3, 0)), 0, 1e-12);
    EXPECT_NEAR(signed_distance_m(part, part.a_m + Vec3(0.2, 0, 0)), 0, 1e-12);
    EXPECT_NEAR(signed_distance_m(part, part.a_m + Vec3(0, 0, 0.1)), 0, 1e-12);
    EXPECT_LT(signed_distance_m(part, part.a_m), -0.09);
  }
  EXPECT_LT(signed_distance_m(part, part.a_m + Vec3(0.19, 0.29, 0.09)), 0) << "a corner of a box";
  part = {RegionForm::tube, Vec3::Zero(), Vec3(1, 0, 0), 0.2, 0.1};
  EXPECT_NEAR(signed_distance_m(part, Vec3(-0.2, 0, 0)), 0, 1e-12);
  EXPECT_NEAR(signed_distance_m(part, Vec3(0.5, 0.15, 0)), 0, 1e-12);
  EXPECT_NEAR(signed_distance_m(part, Vec3(1, 0, -0.1)), 0, 1e-12);
}

TEST(Regions, a_ball_said_to_be_of_one_region_is) {
  Regions regions = tumour_and_vessel();
  regions[0].parts[0].b_m = Vec3(0.012, 0.004, 0.008);
  regions[0].ripple_m = 0.001;
  regions[1].parts[0].radius_b_m = 0.02;
  test::Random random(3);
  std::uniform_real_distribution<double> place(-0.01, 0.05), radius(0, 0.01);
  int uniform = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 centre(place(random), place(random), place(random));
    const double r = radius(random);
    if (!is_one_region(regions, centre, r)) continue;
    ++uniform;
    const Vec3 inside = centre + r * 0.99 * Vec3(place(random), place(random), place(random)).normalized();
    EXPECT_EQ(region_at(regions, inside), region_at(regions, centre));
  }
  EXPECT_GT(uniform, 1000);
}

TEST(Regions, ripples_are_smooth_and_bounded) {
  double most = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x(0.0013 * i, 0.0007 * i, -0.0009 * i);
    most = std::max(most, std::abs(ripple_at(x)));
    EXPECT_LT(std::abs(ripple_at(x + Vec3(1e-5, 0, 0)) - ripple_at(x)), 0.02);
  }
  EXPECT_LE(most, 1);
  EXPECT_GT(most, 0.5);
}

TEST(Regions, what_no_scene_can_have_has_a_flaw) {
  EXPECT_EQ(flaw_of(tumour_and_vessel()), "");
  Regions regions = tumour_and_vessel();
  regions[0].parts.resize(33, regions[0].parts[0]);
  EXPECT_EQ(flaw_of(regions), "34 ellipsoids, boxes and pieces of tubes; at most 32 can be drawn");
  regions = tumour_and_vessel();
  regions.resize(17, regions[0]);
  EXPECT_NE(flaw_of(regions), "");
  for (const auto& spoil : {+[](Region& r) { r.parts.clear(); }, +[](Region& r) { r.parts[0].b_m.y() = 0; },
                            +[](Region& r) { r.parts[0].a_m.x() = NAN; }, +[](Region& r) { r.colour.x() = 2; },
                            +[](Region& r) { r.stiffness_factor = 0; }, +[](Region& r) { r.rim_m = -1; }}) {
    regions = tumour_and_vessel();
    spoil(regions[0]);
    EXPECT_NE(flaw_of(regions), "");
  }
}

TEST(RegionVolumes, of_tetrahedra_add_up_and_agree_with_the_formula) {
  const Regions regions = tumour_and_vessel();
  const double r = 0.012, tube = 0.003, cap = r - std::sqrt(r * r - tube * tube);
  // The tumour without the vessel: a sphere minus a cylinder and two caps.
  const double inside = kPi * tube * tube * 2 * (r - cap) + 2 * kPi * cap * cap * (3 * r - cap) / 3;
  const double tumour = 4 * kPi / 3 * r * r * r - inside;
  for (const int cells : {2, 7}) {
    const TetMesh mesh = test::tet_box(cells, cells, cells, Vec3::Constant(0.04));
    const RegionVolumes v = region_volumes(regions, mesh.vertices_body_m, mesh.tetrahedra);
    EXPECT_NEAR(v.region_m3[0], tumour, 0.01 * tumour) << cells;
    EXPECT_NEAR(v.region_m3[1], kPi * tube * tube * 0.04, 0.02 * v.region_m3[1]) << cells;
    EXPECT_NEAR(v.total_m3(), 0.04 * 0.04 * 0.04, 1e-12);
    EXPECT_EQ(v.marked_m3(regions), v.region_m3[0]);
  }
}

TEST(RegionVolumes, of_parts_add_up_to_the_whole) {
  const Regions regions = tumour_and_vessel();
  const TetMesh mesh = test::tet_box(5, 5, 5, Vec3::Constant(0.04));
  const auto volumes = [&](std::size_t from, std::size_t count) {
    return region_volumes(regions, mesh.vertices_body_m, std::span(mesh.tetrahedra).subspan(from, count));
  };
  const std::size_t all = mesh.tetrahedra.size();
  const RegionVolumes whole = volumes(0, all), a = volumes(0, all / 3), b = volumes(all / 3, all - all / 3);
  for (std::size_t i = 0; i < regions.size(); ++i)
    EXPECT_NEAR(whole.region_m3[i], a.region_m3[i] + b.region_m3[i], 1e-15);
}

TEST(RegionVolumes, of_a_surface_are_those_of_its_inside) {
  const Regions regions = tumour_and_vessel();
  const TriangleSoup soup = test::ellipsoid(4, Vec3(0.06, 0.055, 0.055));
  TriangleMesh mesh(soup);
  const double whole_m3 = check(mesh).volume_m3;
  const RegionVolumes v = region_volumes(regions, mesh.rest_body_m(), mesh.triangles());
  EXPECT_NEAR(v.total_m3(), whole_m3, 1e-3 * whole_m3);
  const double r = 0.012;
  EXPECT_NEAR(v.region_m3[0], 4 * kPi / 3 * r * r * r - 2 * kPi * r * 0.003 * 0.003, 0.02 * v.region_m3[0]);
  EXPECT_EQ(region_volumes(regions, mesh.rest_body_m(), std::span<const Triangle>()).total_m3(), 0);
}

TEST(RegionVolumes, a_slit_that_is_closed_at_rest_takes_nothing_away) {
  // A box with a slit in it: two coincident triangles, face to face.
  TriangleSoup soup = test::box(3, 3, 3, Vec3::Constant(0.04));
  const Regions regions = tumour_and_vessel();
  const auto as_triangles = [](const TriangleSoup& s) {
    std::vector<Triangle> triangles;
    for (const auto& t : s.triangles) triangles.push_back({t, Surface::skin});
    return triangles;
  };
  const double before = region_volumes(regions, soup.vertices_body_m, as_triangles(soup)).total_m3();
  const auto first = static_cast<VertexId>(soup.vertices_body_m.size());
  soup.vertices_body_m.insert(soup.vertices_body_m.end(),
                              {Vec3(0.01, 0.01, 0.02), Vec3(0.03, 0.01, 0.021), Vec3(0.01, 0.03, 0.022)});
  soup.triangles.push_back({first, first + 1, first + 2});
  soup.triangles.push_back({first, first + 2, first + 1});
  EXPECT_NEAR(region_volumes(regions, soup.vertices_body_m, as_triangles(soup)).total_m3(), before, 1e-12);
  EXPECT_NEAR(before, 6.4e-5, 1e-8);
}

}  // namespace
}  // namespace sectio::material_test
