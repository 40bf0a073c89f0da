#include "common/mesh/check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/shapes.h"

namespace sectio::mesh_test {
namespace {

TriangleSoup tetrahedron(const Vec3& origin_m = Vec3::Zero()) {
  return {{origin_m, origin_m + Vec3::UnitX(), origin_m + Vec3::UnitY(), origin_m + Vec3::UnitZ()},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

TriangleSoup octahedron() {
  TriangleSoup soup{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}, {}};
  const VertexId ring[4] = {0, 2, 1, 3};
  for (int i = 0; i < 4; ++i) {
    const VertexId a = ring[i], b = ring[(i + 1) % 4];
    soup.triangles.push_back({a, b, 4});
    soup.triangles.push_back({b, a, 5});
  }
  return soup;
}

// A torus of n x n quads, each cut into two triangles.
TriangleSoup torus(std::uint32_t n) {
  TriangleSoup soup;
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const double u = 2 * M_PI * i / n, v = 2 * M_PI * j / n;
      soup.vertices_body_m.emplace_back((2 + std::cos(v)) * std::cos(u), (2 + std::cos(v)) * std::sin(u), std::sin(v));
      const std::uint32_t i1 = (i + 1) % n, j1 = (j + 1) % n;
      soup.triangles.push_back({i * n + j, i1 * n + j, i1 * n + j1});
      soup.triangles.push_back({i * n + j, i1 * n + j1, i * n + j1});
    }
  }
  return soup;
}

TEST(CheckSoup, accepts_a_tetrahedron) {
  const SurfaceReport report = check_soup(tetrahedron());
  EXPECT_TRUE(report.valid()) << report.first_defect;
  EXPECT_EQ(report.first_defect, "");
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_EQ(report.triangles, 4u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.euler_characteristic, 2);
  EXPECT_NEAR(report.volume_m3, 1.0 / 6, 1e-15);
}

TEST(CheckSoup, volume_is_signed_and_does_not_depend_on_the_origin) {
  EXPECT_NEAR(check_soup(octahedron()).volume_m3, 4.0 / 3, 1e-14);
  EXPECT_NEAR(check_soup(tetrahedron(Vec3(1e6, -1e6, 1e6))).volume_m3, 1.0 / 6, 1e-9);
  TriangleSoup inside_out = octahedron();
  for (auto& t : inside_out.triangles) std::swap(t[1], t[2]);
  const SurfaceReport report = check_soup(inside_out);
  EXPECT_TRUE(report.valid());
  EXPECT_NEAR(report.volume_m3, -4.0 / 3, 1e-14);
}

TEST(CheckSoup, torus_has_euler_characteristic_zero) {
  const SurfaceReport report = check_soup(torus(12));
  EXPECT_TRUE(report.valid()) << report.first_defect;
  EXPECT_EQ(report.euler_characteristic, 0);
  EXPECT_EQ(report.components, 1u);
  EXPECT_GT(report.volume_m3, 0);
}

TEST(CheckSoup, counts_components_and_sums_their_euler_characteristics) {
  const SurfaceReport report = check_soup(test::joined(test::joined(tetrahedron(), torus(5)), octahedron()));
  EXPECT_TRUE(report.valid()) << report.first_defect;
  EXPECT_EQ(report.components, 3u);
  EXPECT_EQ(report.euler_characteristic, 4);
}

TEST(CheckSoup, hole_is_open_and_named) {
  TriangleSoup soup = octahedron();
  soup.triangles.pop_back();
  const SurfaceReport report = check_soup(soup);
  EXPECT_FALSE(report.closed);
  EXPECT_TRUE(report.manifold);
  EXPECT_EQ(report.defects, 3u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_NE(report.first_defect.find("edge 0-3 at (0.5, -0.5, 0) m"), std::string::npos) << report.first_defect;
}

TEST(CheckSoup, flipped_triangle_is_not_oriented) {
  TriangleSoup soup = octahedron();
  std::swap(soup.triangles[2][0], soup.triangles[2][1]);
  const SurfaceReport report = check_soup(soup);
  EXPECT_FALSE(report.valid());
  EXPECT_FALSE(report.closed);
  EXPECT_EQ(report.defects, 3u);
  EXPECT_NE(report.first_defect.find("opposite orientation"), std::string::npos) << report.first_defect;
}

TEST(CheckSoup, duplicated_triangle_is_not_manifold) {
  TriangleSoup soup = octahedron();
  soup.triangles.push_back(soup.triangles[3]);
  const SurfaceReport report = check_soup(soup);
  EXPECT_FALSE(report.manifold);
  EXPECT_NE(report.first_defect.find("joins 3 triangles"), std::string::npos) << report.first_defect;
}

TEST(CheckSoup, edge_of_four_triangles_is_not_manifold) {
  // Two tetrahedra that share the edge 0-1.
  TriangleSoup soup = test::joined(tetrahedron(), tetrahedron());
  soup.vertices_body_m[6] = -Vec3::UnitY();
  soup.vertices_body_m[7] = -Vec3::UnitZ();
  for (auto& t : soup.triangles) {
    for (auto& v : t) v = v == 4 ? 0 : v == 5 ? 1 : v > 5 ? v - 2 : v;
  }
  soup.vertices_body_m.erase(soup.vertices_body_m.begin() + 4, soup.vertices_body_m.begin() + 6);
  const SurfaceReport report = check_soup(soup);
  EXPECT_TRUE(report.closed);
  EXPECT_FALSE(report.manifold);
  EXPECT_EQ(report.defects, 1u);
  EXPECT_NE(report.first_defect.find("edge 0-1"), std::string::npos) << report.first_defect;
}

TEST(CheckSoup, pinched_vertex_is_not_manifold) {
  // Two tetrahedra that touch at vertex 0: every edge is fine, the vertex has two fans.
  TriangleSoup soup = test::joined(tetrahedron(), tetrahedron(Vec3(-2, -2, -2)));
  for (auto& t : soup.triangles) {
    for (auto& v : t) v = v == 4 ? 0 : v > 4 ? v - 1 : v;
  }
  soup.vertices_body_m.erase(soup.vertices_body_m.begin() + 4);
  const SurfaceReport report = check_soup(soup);
  EXPECT_TRUE(report.closed);
  EXPECT_FALSE(report.manifold);
  EXPECT_EQ(report.defects, 1u);
  EXPECT_NE(report.first_defect.find("vertex 0 at (0, 0, 0) m"), std::string::npos) << report.first_defect;
}

TEST(CheckSoup, t_junction_is_open) {
  // The edge 0-1 of one face is split by a vertex that the face beyond does not have.
  TriangleSoup soup = tetrahedron();
  soup.vertices_body_m.emplace_back(0.5, 0, 0);
  soup.triangles[0] = {0, 2, 4};
  soup.triangles.push_back({4, 2, 1});
  const SurfaceReport report = check_soup(soup);
  EXPECT_FALSE(report.closed);
  EXPECT_EQ(report.defects, 3u);
}

TEST(CheckSoup, two_triangles_back_to_back_are_no_surface) {
  TriangleSoup soup{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  const SurfaceReport report = check_soup(soup);
  EXPECT_TRUE(report.closed);
  EXPECT_FALSE(report.manifold);
}

TEST(CheckSoup, not_finite_is_refused_and_has_no_volume) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    TriangleSoup soup = octahedron();
    soup.vertices_body_m[2].y() = bad;
    const SurfaceReport report = check_soup(soup);
    EXPECT_FALSE(report.finite);
    EXPECT_EQ(report.volume_m3, 0);
    EXPECT_NE(report.first_defect.find("vertex 2"), std::string::npos) << report.first_defect;
  }
}

TEST(CheckSoup, indices_out_of_range_repeated_or_unused_are_refused) {
  for (const VertexId bad : {VertexId{6}, kNone, VertexId{4}}) {
    TriangleSoup soup = octahedron();
    soup.triangles[0][0] = bad;
    EXPECT_FALSE(check_soup(soup).valid()) << bad;
  }
  TriangleSoup soup = octahedron();
  soup.vertices_body_m.emplace_back(3, 3, 3);
  const SurfaceReport report = check_soup(soup);
  EXPECT_FALSE(report.manifold);
  EXPECT_NE(report.first_defect.find("vertex 6"), std::string::npos) << report.first_defect;
}

TEST(CheckSoup, nothing_is_not_closed) {
  EXPECT_FALSE(check_soup({}).valid());
}

TEST(CheckSoup, two_million_triangles_are_checked) {
  const SurfaceReport report = check_soup(torus(1000));
  EXPECT_TRUE(report.valid()) << report.first_defect;
  EXPECT_EQ(report.triangles, 2'000'000u);
  EXPECT_EQ(report.euler_characteristic, 0);
}

}  // namespace
}  // namespace sectio::mesh_test
