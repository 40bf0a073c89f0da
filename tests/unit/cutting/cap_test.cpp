// Caps close their rims: each edge has two triangles, none is a splinter, and the area is that of the rim.
#include "sim_server/surface/cutting/cap.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace sectio::cutting_test {
namespace {

std::vector<VertexState> ellipse(int n, double long_m, double short_m, double uneven, test::Random64& random) {
  std::vector<VertexState> rim(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const double jitter = uneven * (std::uniform_real_distribution<double>(-0.5, 0.5)(random));
    const double angle = 2 * std::numbers::pi * (i + jitter) / n;
    VertexState& s = rim[static_cast<std::size_t>(i)];
    s.rest_body_m = Vec3(long_m * std::cos(angle), short_m * std::sin(angle), 0.003);
    s.position_world_m = 2 * s.rest_body_m + Vec3(1, 0, 0);
    s.velocity_world_m_per_s = Vec3(0, 0, s.rest_body_m.x());
  }
  return rim;
}

double least_angle_deg(const std::array<Vec3, 3>& x) {
  double least = 180;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 a = x[(i + 1) % 3] - x[i], b = x[(i + 2) % 3] - x[i];
    least = std::min(least, std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi);
  }
  return least;
}

struct Case {
  int vertices;
  double slender, uneven, least_deg;
};

TEST(Cap, closes_its_rim_without_splinters) {
  test::Random64 random(7);
  for (const Case& c : {Case{3, 1, 0, 25}, Case{7, 1, 0, 25}, Case{24, 1, 0, 20}, Case{100, 1, 0, 20},
                        Case{1000, 1, 0, 20}, Case{60, 2, 0, 10}, Case{60, 1, 0.6, 9}, Case{40, 1.5, 0.6, 7}}) {
    SCOPED_TRACE(testing::Message() << c.vertices << " vertices, " << c.slender << " times as long as wide");
    const std::vector<VertexState> rim = ellipse(c.vertices, 0.01 * c.slender, 0.01, c.uneven, random);
    const Cap cap = cap_of(rim);
    EXPECT_LE(cap.inner.size(), 4 * rim.size());
    const auto rest = [&](std::uint32_t v) {
      return v < rim.size() ? rim[v].rest_body_m : cap.inner[v - rim.size()].rest_body_m;
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double area_m2 = 0, rim_m2 = 0, least_deg = 180;
    for (const auto& t : cap.triangles) {
      const std::array x{rest(t[0]), rest(t[1]), rest(t[2])};
      least_deg = std::min(least_deg, least_angle_deg(x));
      const double z_m2 = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).z();
      EXPECT_GT(z_m2, 0);
      area_m2 += z_m2;
      for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    }
    for (std::uint32_t i = 0; i < rim.size(); ++i) {
      const std::uint32_t next = (i + 1) % static_cast<std::uint32_t>(rim.size());
      rim_m2 += 0.5 * rest(i).cross(rest(next)).z();
      EXPECT_EQ(edges.count({i, next}), 1u);
      EXPECT_EQ(edges.count({next, i}), 0u);
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      const bool is_of_rim = edge.first < rim.size() && edge.second < rim.size();
      EXPECT_TRUE(is_of_rim || edges.contains({edge.second, edge.first}));
    }
    EXPECT_NEAR(area_m2, rim_m2, 1e-9 * rim_m2);
    EXPECT_GT(least_deg, c.least_deg);
  }
}

TEST(Cap, moves_as_its_rim_does) {
  test::Random64 random(8);
  for (const VertexState& s : cap_of(ellipse(50, 0.02, 0.01, 0.3, random)).inner) {
    EXPECT_LT((s.position_world_m - (2 * s.rest_body_m + Vec3(1, 0, 0))).norm(), 1e-12);
    EXPECT_NEAR(s.velocity_world_m_per_s.z(), s.rest_body_m.x(), 1e-12);
  }
}

}  // namespace
}  // namespace sectio::cutting_test
