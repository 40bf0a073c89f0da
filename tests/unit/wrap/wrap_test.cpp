// Bodies around triangles as they come: open, doubled, crossing themselves, in many parts.
#include "sim_server/wrap/wrap.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "tests/support/shapes.h"

namespace sectio::wrap_test {
namespace {

constexpr double kBall_m3 = 4.0 / 3 * M_PI * 0.03 * 0.03 * 0.03;

TriangleSoup ball(const Vec3& at = Vec3::Zero(), double radius_m = 0.03) {
  TriangleSoup soup = test::ellipsoid(4, Vec3::Constant(radius_m));
  for (Vec3& p : soup.vertices_body_m) p += at;
  return soup;
}
void turn(TriangleSoup& soup) {
  for (auto& t : soup.triangles) std::swap(t[1], t[2]);
}

void expect_good(const Wrapped& w, double volume_m3, std::uint32_t parts = 1) {
  const SurfaceReport report = check_soup(w.soup);
  EXPECT_TRUE(report.valid()) << report.first_defect;
  EXPECT_EQ(report.components, parts);
  EXPECT_NEAR(report.volume_m3 / volume_m3, 1, 0.02);
  EXPECT_GT(w.least_angle_rad, 5 * M_PI / 180);
  EXPECT_NEAR(w.volume_m3, report.volume_m3, 1e-12);
}

TEST(Wrap, closed_surface_stays_itself) {
  for (const double size_m : {0.0, 0.002, 0.006}) {
    const Wrapped w = wrap(ball(), size_m);
    expect_good(w, kBall_m3);
    EXPECT_LT(w.furthest_m, 0.25 * w.size_m);
    EXPECT_EQ(check_soup(w.soup).euler_characteristic, 2);
    if (size_m > 0) {
      EXPECT_EQ(w.size_m, size_m);
    }
  }
}

TEST(Wrap, an_open_surface_is_closed) {
  TriangleSoup open = ball();
  std::erase_if(open.triangles, [&](const auto& t) { return open.vertices_body_m[t[0]].z() > 0.0277; });
  const double cap_m = 0.0023;  // its height, which a flat lid would take away
  const double cap_m3 = M_PI * cap_m * cap_m * (0.03 - cap_m / 3);
  ASSERT_FALSE(check_soup(open).valid());
  const Wrapped w = wrap(open, 0.003);
  expect_good(w, kBall_m3 - 0.5 * cap_m3);
  for (const Vec3& p : w.soup.vertices_body_m) EXPECT_LT(std::abs(p.norm() - 0.03), w.size_m);
}

TEST(Wrap, doubled_and_inverted_surfaces_are_one_body) {
  TriangleSoup doubled = ball(), inner = ball(Vec3::Zero(), 0.0295), same = ball();
  turn(inner);
  doubled = test::joined(std::move(doubled), inner);
  doubled = test::joined(std::move(doubled), same);
  const Wrapped w = wrap(doubled, 0.003);
  expect_good(w, kBall_m3);
  EXPECT_LT(w.furthest_m, w.size_m);
  TriangleSoup inside_out = ball();
  turn(inside_out);
  expect_good(wrap(inside_out, 0.003), kBall_m3);
}

TEST(Wrap, parts_that_cross_become_their_union) {
  TriangleSoup crossing = ball();
  crossing = test::joined(std::move(crossing), ball(Vec3(0.03, 0, 0)));
  const double lens_m3 = M_PI * (4 * 0.03 + 0.03) * std::pow(2 * 0.03 - 0.03, 2) / 12;
  const Wrapped w = wrap(crossing, 0.003);
  expect_good(w, 2 * kBall_m3 - lens_m3);
  EXPECT_LT(w.furthest_m, w.size_m);
}

// One of them is inside out, so that the volumes of both together are nothing.
TEST(Wrap, parts_that_share_a_corner_become_their_union) {
  TriangleSoup other = ball(Vec3(0.03, 0, 0));
  turn(other);
  TriangleSoup crossing = test::joined(ball(), other);
  const auto shared = static_cast<VertexId>(ball().vertices_body_m.size());  // the first corner of the other one
  for (auto& t : crossing.triangles)
    for (VertexId& v : t)
      if (v == shared) v = 0;
  const double lens_m3 = M_PI * (4 * 0.03 + 0.03) * std::pow(2 * 0.03 - 0.03, 2) / 12;
  const Wrapped w = wrap(crossing, 0.003);
  EXPECT_NEAR(w.volume_m3 / (2 * kBall_m3 - lens_m3), 1, 0.1) << "the shared corner pulls at the other ball";
}

TEST(Wrap, parts_that_are_apart_stay_so_and_crumbs_go) {
  TriangleSoup parts = ball();
  parts = test::joined(std::move(parts), ball(Vec3(0.1, 0, 0)));
  parts = test::joined(std::move(parts), ball(Vec3(0.05, 0.05, 0), 0.004));
  const Wrapped w = wrap(parts, 0.003);
  expect_good(w, 2 * kBall_m3, 2);
  EXPECT_EQ(w.bubbles, 1u);
  EXPECT_GT(w.furthest_m, 0.03) << "the crumb is not in the soup";
}

TEST(Wrap, two_open_halves_that_do_not_meet_are_one_body) {
  TriangleSoup halves = ball(), other = ball(Vec3(0, 0, 0.0005));
  std::erase_if(halves.triangles, [&](const auto& t) { return halves.vertices_body_m[t[0]].z() > 0; });
  std::erase_if(other.triangles, [&](const auto& t) { return other.vertices_body_m[t[0]].z() <= 0.0005; });
  turn(other);
  halves = test::joined(std::move(halves), other);
  const Wrapped w = wrap(halves, 0.003);
  expect_good(w, kBall_m3 + M_PI * 0.03 * 0.03 * 0.0005);
  EXPECT_LT(w.furthest_m, w.size_m);
}

TEST(Wrap, edges_of_a_box_are_rounded_within_the_size) {
  TriangleSoup box;
  for (int i = 0; i < 8; ++i)
    box.vertices_body_m.push_back(Vec3(i & 1, i >> 1 & 1, i >> 2).cwiseProduct(Vec3(0.1, 0.06, 0.04)));
  box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  const Wrapped w = wrap(box, 0.004);
  expect_good(w, 0.1 * 0.06 * 0.04);
  EXPECT_LT(w.furthest_m, w.size_m);
}

TEST(Wrap, a_bottle_with_a_thin_wall_is_filled_up_to_its_mouth) {
  TriangleSoup bottle = ball(), inside = ball(Vec3::Zero(), 0.0295);
  turn(inside);
  bottle = test::joined(std::move(bottle), inside);
  std::erase_if(bottle.triangles, [&](const auto& t) { return bottle.vertices_body_m[t[0]].z() > 0.029; });
  for (const double size_m : {0.004, 0.003}) {
    const Wrapped w = wrap(bottle, size_m, 0.012 / size_m);  // it sinks 2.8 mm into the mouth, which is 15 mm wide
    expect_good(w, kBall_m3);
    for (const Vec3& p : w.soup.vertices_body_m) ASSERT_LT(std::abs(p.norm() - 0.03), 0.0045);
  }
  EXPECT_THROW(wrap(bottle, 0.003, 1), InputError) << "a ball of 3 mm gets in";
}

TEST(Wrap, a_closed_body_is_the_same_by_either_way) {
  const Wrapped by_winding = wrap(ball(), 0.003), by_ball = wrap(ball(), 0.003, 2);
  EXPECT_NEAR(by_ball.volume_m3 / by_winding.volume_m3, 1, 0.005);
  EXPECT_LT(by_ball.furthest_m, 0.25 * by_ball.size_m);
}

TEST(Wrap, the_same_input_gives_the_same_bits) {
  const Wrapped a = wrap(ball(), 0.004), b = wrap(ball(), 0.004);
  EXPECT_EQ(a.soup.triangles, b.soup.triangles);
  EXPECT_EQ(a.soup.vertices_body_m, b.soup.vertices_body_m);
}

TEST(Wrap, refuses_what_encloses_nothing) {
  TriangleSoup sheet;
  sheet.vertices_body_m = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}};
  sheet.triangles = {{0, 1, 2}};
  EXPECT_THROW(wrap(sheet), InputError);
  EXPECT_THROW(wrap(sheet, 0.004, 2), InputError);
  EXPECT_THROW(wrap({}), InputError);
  EXPECT_THROW(wrap(ball(), 1e-5), InputError) << "too small";
  EXPECT_THROW(wrap(ball(), 1), InputError) << "too large";
}

}  // namespace
}  // namespace sectio::wrap_test
