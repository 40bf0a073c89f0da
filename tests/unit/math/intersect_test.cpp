#include "common/math/intersect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/math/orientation.h"
#include "tests/support/random.h"

namespace sectio::math_test {
namespace {

using Random = test::Random64;

double uniform(Random& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}
Vec3 uniform_vec(Random& random, double low, double high) {
  const double x = uniform(random, low, high), y = uniform(random, low, high), z = uniform(random, low, high);
  return {x, y, z};
}
Vec3 to_float(const Vec3& v) {
  return v.cast<float>().cast<double>();
}

// A closed surface around the origin: an octahedron, each face divided n times, corners rounded to floats.
std::vector<Corners> sphere(int n, double bump) {
  std::vector<Corners> triangles;
  for (int face = 0; face < 8; ++face) {
    const Vec3 x((face & 1) ? -1 : 1, 0, 0), y(0, (face & 2) ? -1 : 1, 0), z(0, 0, (face & 4) ? -1 : 1);
    const auto at = [&](int i, int j) {
      const Vec3 u = ((n - i - j) * x + i * y + j * z).normalized();
      return to_float(u * (1 + bump * std::sin(5 * u.x()) * std::sin(4 * u.y() + 3 * u.z())));
    };
    const bool flip = x.cross(y).dot(z) < 0;
    const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      triangles.push_back(flip ? Corners{a, c, b} : Corners{a, b, c});
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  return triangles;
}

std::vector<Crossing> cross_all(const std::vector<Corners>& surface, const Vec3& p, const Vec3& q) {
  std::vector<Crossing> found;
  for (const Corners& t : surface)
    if (const auto c = cross_segment(p, q, t)) found.push_back(*c);
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.parameter < b.parameter; });
  return found;
}

TEST(Orientation, sign_agrees_with_integers) {
  Random random(1);
  const auto coordinate = [&] { return static_cast<std::int64_t>(random() % (1 << 18)); };
  int zeros = 0;
  for (int k = 0; k < 20000; ++k) {
    std::array<std::array<std::int64_t, 3>, 4> x;
    for (auto& point : x)
      for (auto& c : point) c = coordinate();
    if (k % 2)  // nearly coplanar: the fourth point is a corner of the parallelogram, or one unit off
      for (std::size_t i = 0; i < 3; ++i) x[3][i] = x[1][i] + x[2][i] - x[0][i];
    if (k % 4 == 1) x[3][random() % 3] += 1;
    std::array<std::array<std::int64_t, 3>, 3> d;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t i = 0; i < 3; ++i) d[r][i] = x[r + 1][i] - x[0][i];
    const std::int64_t det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                             d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                             d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    std::array<Vec3, 4> p;
    for (std::size_t r = 0; r < 4; ++r)
      p[r] = Vec3(static_cast<double>(x[r][0]), static_cast<double>(x[r][1]), static_cast<double>(x[r][2])) * 0x1p-20;
    ASSERT_EQ(orientation(p[0], p[1], p[2], p[3]).sign, (det > 0) - (det < 0)) << k;
    zeros += det == 0;
  }
  EXPECT_GT(zeros, 4000);
}

TEST(Orientation, odd_permutations_flip_the_sign_of_nearly_flat_points) {
  Random random(2);
  for (int k = 0; k < 5000; ++k) {
    std::array<Vec3, 4> p;
    for (auto& x : p) x = uniform_vec(random, -1, 1);
    const double u = uniform(random, 0, 1), v = uniform(random, 0, 1);
    p[3] = p[0] + u * (p[1] - p[0]) + v * (p[2] - p[0]);  // flat up to rounding
    const int sign = orientation(p[0], p[1], p[2], p[3]).sign;
    EXPECT_EQ(orientation(p[1], p[0], p[2], p[3]).sign, -sign);
    EXPECT_EQ(orientation(p[3], p[1], p[2], p[0]).sign, -sign);
    EXPECT_EQ(orientation(p[1], p[2], p[3], p[0]).sign, -sign);
    EXPECT_EQ(orientation(p[1], p[2], p[0], p[3]).sign, sign);
  }
}

TEST(Intersect, point_parameter_and_barycentrics) {
  const Corners t{Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)};
  const auto c = cross_segment({0.5, 0.25, 1}, {0.5, 0.25, -3}, t);
  ASSERT_TRUE(c);
  EXPECT_TRUE(c->entering);
  EXPECT_DOUBLE_EQ(c->parameter, 0.25);
  EXPECT_NEAR((c->bary - Vec3(0.625, 0.25, 0.125)).norm(), 0, 1e-15);
  EXPECT_NEAR((c->point - Vec3(0.5, 0.25, 0)).norm(), 0, 1e-15);
  EXPECT_FALSE(cross_segment({0.5, 0.25, -1}, {0.5, 0.25, 1}, t)->entering);
  EXPECT_FALSE(cross_segment({0.5, 0.25, 3}, {0.5, 0.25, 1}, t));
  EXPECT_FALSE(cross_segment({1.5, 0.75, 1}, {1.5, 0.75, -1}, t));
  EXPECT_TRUE(cross_ray({0.5, 0.25, 3}, {0, 0, -0.1}, t));
  EXPECT_DOUBLE_EQ(cross_ray({0.5, 0.25, 3}, {0, 0, -0.1}, t)->parameter, 30);
  EXPECT_FALSE(cross_ray({0.5, 0.25, 3}, {0, 0, 0.1}, t));
}

TEST(Intersect, degenerate_triangles_and_segments_cross_nothing) {
  const Corners line{Vec3(0, 0, 0), Vec3(1, 1, 0), Vec3(2, 2, 0)};
  EXPECT_FALSE(cross_segment({1, 1, 1}, {1, 1, -1}, line));
  const Corners t{Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)};
  EXPECT_FALSE(cross_segment({0.5, 0.5, 0}, {0.5, 0.5, 0}, t));
  EXPECT_FALSE(cross_segment({-1, 0, 0}, {3, 0, 0}, t)) << "along an edge";
  EXPECT_FALSE(cross_segment({0.1, 0.1, 0}, {0.5, 0.5, 0}, t)) << "in the plane";
}

// A segment from inside to outside through a vertex, or as exactly as possible through a point of an edge, crosses
// once.
TEST(Intersect, watertight_at_vertices_and_edges) {
  Random random(3);
  const auto surface = sphere(6, 0.1);
  int exact = 0;
  for (int k = 0; k < 4000; ++k) {
    const Corners& t = surface[random() % surface.size()];
    const double s = k % 2 ? static_cast<double>(random() % 9) / 8 : 0;
    const Vec3 target = t[0] + s * (t[1] - t[0]);
    const Vec3 p = k % 3 ? Vec3(to_float(uniform_vec(random, -0.2, 0.2))) : Vec3(0, 0, 0);
    const Vec3 q = p + 2 * (target - p);
    const auto found = cross_all(surface, p, q);
    ASSERT_EQ(found.size(), 1u) << k;
    EXPECT_FALSE(found[0].entering);
    EXPECT_NEAR((found[0].point - target).norm(), 0, 1e-12);
    exact += orientation(p, q, t[0], t[1]).sign == 0;
  }
  EXPECT_GT(exact, 500);  // the hard cases have occurred
}

TEST(Intersect, crossings_alternate) {
  Random random(4);
  const auto surface = sphere(5, 0.3);
  const std::vector<Corners>& s = surface;
  for (int k = 0; k < 2000; ++k) {
    Vec3 p = 3 * uniform_vec(random, -1, 1).normalized(), q = 3 * uniform_vec(random, -1, 1).normalized();
    if (k % 2) {  // through two corners of the surface
      const Vec3 u = s[random() % s.size()][0], v = s[random() % s.size()][1];
      if (u == v) continue;
      p = u + 8 * (u - v);
      q = v + 8 * (v - u);
    }
    const auto found = cross_all(surface, p, q);
    ASSERT_EQ(found.size() % 2, 0u) << k;
    int depth = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      depth += found[i].entering ? 1 : -1;
      if (i + 1 == found.size()) {
        EXPECT_EQ(depth, 0) << k;
      } else if (found[i + 1].parameter - found[i].parameter > 1e-9) {
        // Crossings at one vertex have the same parameter up to rounding, in any order.
        EXPECT_TRUE(depth == 0 || depth == 1) << k;
      }
    }
  }
}

// A path may have corners on the surface, even at vertices: each passage is counted once.
TEST(Intersect, paths_that_stop_on_the_surface_cross_once) {
  Random random(5);
  const auto surface = sphere(4, 0.1);
  for (int k = 0; k < 2000; ++k) {
    const Corners& t = surface[random() % surface.size()];
    const Vec3 on = k % 2 ? t[0] : Vec3(0.5 * (t[0] + t[1]));
    const Vec3 in = uniform_vec(random, -0.1, 0.1), out = 3 * uniform_vec(random, -1, 1).normalized();
    const auto first = cross_all(surface, in, on), second = cross_all(surface, on, out);
    int balance = 0;
    for (const auto& c : first) balance += c.entering ? 1 : -1;
    for (const auto& c : second) balance += c.entering ? 1 : -1;
    EXPECT_EQ(balance, -1) << k;
  }
}

// There is no gap between the two triangles of a sweep, nor between these and those of the next sweep.
TEST(Intersect, swept_path_has_no_seams) {
  Random random(6);
  for (int k = 0; k < 2000; ++k) {
    // A segment of fixed height passes over a fixed vertical one; the seams are hit exactly by steps of 1/8.
    const Vec3 p(0, 0, -1), q(0, 0, 1);
    const Vec3 step(0.125, 0, 0);
    const double start = -0.125 * static_cast<double>(1 + random() % 8);
    int crossings = 0;
    double last_time = -1;
    for (int i = 0; i < 16; ++i) {
      const Vec3 a = Vec3(start, -1, 0) + i * step, b = Vec3(start, 1, 0) + i * step;
      const auto found = cross_swept(p, q, {a, b, a + step, b + step});
      crossings += found.count;
      if (found.count) last_time = i + found.at[0].time;
    }
    ASSERT_EQ(crossings, 1);
    EXPECT_NEAR(last_time * 0.125 + start, 0, 1e-12);
  }
}

TEST(Intersect, swept_parameters) {
  const SweptSegment sweep{Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(1, 1, 0)};
  const auto found = cross_swept({0.75, 0.25, -1}, {0.75, 0.25, 3}, sweep);
  ASSERT_EQ(found.count, 1);
  EXPECT_DOUBLE_EQ(found.at[0].time, 0.75);
  EXPECT_DOUBLE_EQ(found.at[0].along, 0.25);
  EXPECT_DOUBLE_EQ(found.at[0].edge_parameter, 0.25);
  const auto other = cross_swept({0.25, 0.75, -1}, {0.25, 0.75, 3}, sweep);
  ASSERT_EQ(other.count, 1);
  EXPECT_DOUBLE_EQ(other.at[0].time, 0.25);
  EXPECT_DOUBLE_EQ(other.at[0].along, 0.75);
}

TEST(Intersect, closest_point_beats_every_sample) {
  Random random(7);
  for (int k = 0; k < 300; ++k) {
    const Corners t{uniform_vec(random, -1, 1), uniform_vec(random, -1, 1), uniform_vec(random, -1, 1)};
    const Vec3 p = uniform_vec(random, -2, 2);
    const ClosestPoint c = closest_on_triangle(p, t);
    EXPECT_NEAR(c.bary.sum(), 1, 1e-12);
    EXPECT_GE(c.bary.minCoeff(), -1e-12);
    double best = 1e9;
    for (int i = 0; i <= 20; ++i)
      for (int j = 0; i + j <= 20; ++j) {
        const Vec3 x = (i * t[0] + j * t[1] + (20 - i - j) * t[2]) / 20;
        best = std::min(best, (p - x).squaredNorm());
      }
    EXPECT_LE(c.squared_distance, best + 1e-12);
    EXPECT_LE(std::sqrt(best), std::sqrt(c.squared_distance) + 0.2);
  }
}

TEST(Intersect, segment_against_box_agrees_with_clipping) {
  Random random(8);
  int hits = 0;
  for (int k = 0; k < 5000; ++k) {
    Box3 box(uniform_vec(random, -1, 1));
    box.extend(uniform_vec(random, -1, 1));
    const Vec3 p = uniform_vec(random, -2, 2), q = uniform_vec(random, -2, 2);
    double low = 0, high = 1;
    for (int i = 0; i < 3; ++i) {
      double t0 = (box.min()[i] - p[i]) / (q[i] - p[i]), t1 = (box.max()[i] - p[i]) / (q[i] - p[i]);
      if (t0 > t1) std::swap(t0, t1);
      low = std::max(low, t0);
      high = std::min(high, t1);
    }
    if (std::abs(low - high) < 1e-12) continue;
    EXPECT_EQ(overlaps(p, q, box), low <= high) << k;
    hits += low <= high;
  }
  EXPECT_GT(hits, 300);
  EXPECT_FALSE(overlaps({std::nan(""), 0, 0}, {1, 1, 1}, Box3(Vec3(-1, -1, -1), Vec3(1, 1, 1))));
  EXPECT_FALSE(overlaps({0, 0, 0}, {1, 1, 1}, Box3()));
}

}  // namespace
}  // namespace sectio::math_test
