// Bars that bend far, every model at rest under its own driver, against the elastica.
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "tests/support/moving_body.h"
#include "tests/support/static_body.h"

namespace sectio::large_bending_test {
namespace {

using test::MovingBody;
using test::MovingModel;

constexpr double kYoung = 1e4, kDensity = 1000;

// A bar held at x = 0, damped as its slowest vibration is critically, until nothing moves.
struct Tip {
  double down, back;  // the middle of the end, in lengths
};
Tip bent_tip(const MovingModel& model, int across, int slenderness, double poisson, double end_load_n,
             double gravity_m_per_s2) {
  const double side = 0.02, length = slenderness * side;
  const TetMesh mesh = test::tet_box(slenderness * across, across, across, Vec3(length, side, side));
  const double omega = 1.875104 * 1.875104 / (length * length) * std::sqrt(kYoung * side * side / (12 * kDensity));
  VolumeSettings settings;
  settings.step_s = 0.002;
  settings.gravity_m_per_s2 = Vec3(0, 0, -gravity_m_per_s2);
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.x() < 1e-9);
  MovingBody body = model.make(mesh, side / across, {{kYoung, poisson, kDensity}, 2 * omega, {}}, settings);
  const auto end = test::areas_of_vertices_m2(mesh, [&](const Vec3& p) { return p.x() > length - 1e-9; });
  std::vector<PointConstraint> load;
  for (VertexId v = 0; v < end.size() && end_load_n > 0; ++v)
    if (end[v] > 0) load.push_back(test::dead_load(v, Vec3(0, 0, -end_load_n * end[v] / (side * side))));
  body.step(static_cast<int>(10 / omega / settings.step_s), load);
  Tip tip{0, 0};
  for (VertexId v = 0; v < end.size(); ++v) {
    const Vec3 u = body.x[v].head<3>().cast<double>() - mesh.vertices_body_m[v];
    tip.down -= end[v] / (side * side) * u.z() / length;
    tip.back -= end[v] / (side * side) * u.x() / length;
  }
  return tip;
}

struct Case {
  MovingModel model;
  int across, slenderness;
  double poisson, within;
  std::size_t loads;  // the first so many: small and large
};
// Shear adds (1 + nu) 4 / (5 kappa) (h / L)^2 = 1.2 % to a small deflection of a bar ten times as long as thick.
std::vector<Case> cases() {
  return {{test::moving_hexahedra(), 3, 20, 0.3, 0.02, 4},
          {test::moving_tetrahedra(), 5, 10, 0.3, 0.05, 2},
          {test::moving_springs(), 4, 10, 0.25, 0.2, 2}};
}

// P L^2 / E I (Bisshopp and Drucker 1945).
TEST(Accuracy, A_6_elastica_under_a_load_at_its_end) {
  struct Load {
    double alpha, back, down;
  };
  constexpr Load kLoads[] = {
      {1, 0.056433, 0.301721}, {10, 0.554996, 0.810609}, {2, 0.160642, 0.493457}, {5, 0.387628, 0.713792}};
  for (const Case& c : cases())
    for (const Load& load : std::span(kLoads).first(c.loads)) {
      const double length = c.slenderness * 0.02, inertia = std::pow(0.02, 4) / 12;
      const Tip tip =
          bent_tip(c.model, c.across, c.slenderness, c.poisson, load.alpha * kYoung * inertia / (length * length), 0);
      EXPECT_NEAR(tip.down / load.down, 1, c.within) << c.model << " " << load.alpha;
      EXPECT_NEAR(tip.back / load.back, 1, 2 * c.within) << c.model << " " << load.alpha;
    }
}

// w L^3 / E I
TEST(Accuracy, A_7_elastica_under_its_own_weight) {
  struct Load {
    double beta, down;
  };
  constexpr Load kLoads[] = {{1, 0.123471}, {8, 0.640631}, {4, 0.425159}, {16, 0.797020}};
  for (const Case& c : cases())
    for (const Load& load : std::span(kLoads).first(c.loads)) {
      const double length = c.slenderness * 0.02, inertia = std::pow(0.02, 4) / 12, area = 0.02 * 0.02;
      const double gravity = load.beta * kYoung * inertia / (length * length * length * area * kDensity);
      const Tip tip = bent_tip(c.model, c.across, c.slenderness, c.poisson, 0, gravity);
      EXPECT_NEAR(tip.down / load.down, 1, c.within) << c.model << " " << load.beta;
    }
}

}  // namespace
}  // namespace sectio::large_bending_test
