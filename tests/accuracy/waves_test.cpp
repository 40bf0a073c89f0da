// How fast bodies vibrate: natural frequency of a bar in bending, and the wave along it.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/moving_body.h"

namespace sectio::waves_test {
namespace {

using test::MovingBody;
using test::MovingModel;

constexpr double kYoung = 1e4, kDensity = 1000, kSide = 0.01;

struct Case {
  MovingModel model;
  int across;
  double poisson, within;
};

// A bar held at x = 0 is struck: after how many seconds is the middle of its end back the second time, half a period
// after the first? velocity(x / L) along `axis`.
template <class Velocity>
double half_period_s(const Case& c, int slenderness, int axis, double step_s, const Velocity& velocity) {
  const double length = slenderness * kSide;
  const TetMesh mesh = test::tet_box(slenderness * c.across, c.across, c.across, Vec3(length, kSide, kSide));
  VolumeSettings settings;
  settings.step_s = step_s;
  settings.gravity_m_per_s2.setZero();
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.x() < 1e-9);
  MovingBody body = c.model.make(mesh, kSide / c.across, {{kYoung, c.poisson, kDensity}, 0, {}}, settings);
  for (VertexId v = 0; v < body.v.size(); ++v)
    body.v[v][axis] = static_cast<float>(velocity(mesh.vertices_body_m[v].x() / length));
  const auto end_m = [&] {
    double sum = 0;
    int count = 0;
    for (VertexId v = 0; v < body.x.size(); ++v)
      if (mesh.vertices_body_m[v].x() > length - 1e-9)
        sum += double{body.x[v][axis]} - mesh.vertices_body_m[v][axis], ++count;
    return sum / count;
  };
  double before = 0;
  for (int n = 1; n < 100000; ++n) {
    body.step();
    const double now = end_m();
    if (before > 0 && now <= 0) return (n - now / (now - before)) * step_s;  // it began at 0
    before = now;
  }
  return 0;
}

// f = beta^2 / (2 pi L^2) sqrt(E I / rho A), beta L = 1.875104; struck in the form of that vibration.
TEST(Accuracy, A_14_natural_frequency_of_a_bar) {
  const int slenderness = 12;
  const double length = slenderness * kSide, beta = 1.875104;
  const double expected_hz =
      beta * beta / (2 * M_PI * length * length) * std::sqrt(kYoung * kSide * kSide / (12 * kDensity));
  const auto form = [&](double s) {
    const double a = beta * s, r = (std::sinh(beta) - std::sin(beta)) / (std::cosh(beta) + std::cos(beta));
    return 0.01 * (std::cosh(a) - std::cos(a) - r * (std::sinh(a) - std::sin(a)));
  };
  for (const Case& c : {Case{test::moving_hexahedra(), 2, 0.3, 0.02},
                        {test::moving_hexahedra(), 2, 0.45, 0.02},
                        {test::moving_tetrahedra(), 4, 0.3, 0.08},
                        {test::moving_springs(), 4, 0.25, 0.12}}) {
    const double hz = 0.5 / half_period_s(c, slenderness, 2, 0.002, form);
    EXPECT_NEAR(hz / expected_hz, 1, c.within) << c.model << " " << c.poisson;
  }
}

// c = sqrt(E / rho): a wave of four lengths goes there and back in half a period.
TEST(Accuracy, A_15_wave_speed_along_a_bar) {
  const int slenderness = 12;
  for (const Case& c : {Case{test::moving_hexahedra(), 2, 0.45, 0.03},
                        {test::moving_tetrahedra(), 2, 0.45, 0.03},
                        {test::moving_springs(), 4, 0.25, 0.12}}) {
    const double half_s =
        half_period_s(c, slenderness, 0, 1e-4, [](double s) { return 0.01 * std::sin(M_PI / 2 * s); });
    const double speed = 2 * slenderness * kSide / half_s;
    EXPECT_NEAR(speed / std::sqrt(kYoung / kDensity), 1, c.within) << c.model;
  }
}

}  // namespace
}  // namespace sectio::waves_test
