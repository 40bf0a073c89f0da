#include "tests/chart/scene.h"

#include <array>
#include <cmath>
#include <limits>

#include "tests/support/contact_reference.h"

namespace sectio::chart {
namespace {

constexpr double kOnFace_m = 1e-7;

ChartScene bend() {
  ChartScene s;
  s.name = "bend";
  s.title = "a bar sags under its own weight (100 x 25 x 25 mm, 30 kPa, Poisson's ratio 0.45)";
  s.answer = "displacement along its axis";
  s.size_m = {0.1, 0.025, 0.025};
  s.gravity_m_per_s2 = 9.81;
  s.cells_per_across = {4, 1, 1};
  s.held = [](const Vec3& p) { return p.x() < kOnFace_m; };
  s.duration_s = 1.2;
  s.load_s = 1e-9;
  for (int i = 1; i <= 8; ++i) s.probes.push_back({{0.1 * i / 8, 0.0125, 0.0125}});
  return s;
}

ChartScene twist() {
  ChartScene s;
  s.name = "twist";
  s.title = "a bar is twisted by 45 degrees (100 x 25 x 25 mm, 30 kPa, Poisson's ratio 0.45)";
  s.answer = "torque";
  s.size_m = {0.1, 0.025, 0.025};
  s.damping_per_s = 60;
  s.cells_per_across = {4, 1, 1};
  s.held = [](const Vec3& p) { return p.x() < kOnFace_m || p.x() > 0.1 - kOnFace_m; };
  s.held_at = [](const Vec3& p, double share) -> Vec3 {
    if (p.x() < 0.05) return p;
    const Vec3 axis(p.x(), 0.0125, 0.0125);
    return axis + Eigen::AngleAxisd(share * M_PI / 4, Vec3::UnitX()) * (p - axis);
  };
  s.load_s = 0.2;
  s.duration_s = 0.6;
  s.asks_torque = true;
  return s;
}

ChartScene indent() {
  ChartScene s;
  s.name = "indent";
  s.title = "a ball of 10 mm radius is pressed 2 mm into a block (60 x 60 x 20 mm, 10 kPa, Poisson's ratio 0.45)";
  s.answer = "force";
  s.size_m = {0.06, 0.06, 0.02};
  s.young_pa = 10000;
  s.damping_per_s = 60;
  s.cells_per_across = {3, 3, 1};
  s.held = [](const Vec3& p) { return p.z() < kOnFace_m; };
  s.ball = Ball{0.01, 0.002, Vec3::Zero()};
  s.load_s = 0.1;
  s.duration_s = 0.35;
  s.asks_force = true;
  return s;
}

ChartScene open() {
  ChartScene s;
  s.name = "open";
  s.title = "a bar that is cut half through is pulled by 5 % (60 x 10 x 20 mm, 30 kPa, Poisson's ratio 0.45)";
  s.answer = "opening of the cut";
  s.size_m = {0.06, 0.01, 0.02};
  s.damping_per_s = 60;
  s.cells_per_across = {6, 1, 2};
  s.held = [](const Vec3& p) { return p.x() < kOnFace_m || p.x() > 0.06 - kOnFace_m; };
  s.held_at = [](const Vec3& p, double share) -> Vec3 {
    return {p.x() + (p.x() > 0.03 ? share * 0.003 : 0), p.y(), p.z()};
  };
  s.slit = test::Slit{0.03, 0.01};
  s.load_s = 0.1;
  s.duration_s = 0.5;
  s.reference_across = 3;
  for (const double z : {0.02, 0.0175, 0.015}) s.probes.push_back({{0.03, 0.005, z}, true});
  return s;
}

// Moments for a picture each, from the first one on.
std::vector<double> moments(double from_s, double to_s) {
  std::vector<double> at;
  for (int n = 1; from_s + n / 60.0 <= to_s + 1e-9; ++n) at.push_back(from_s + n / 60.0);
  return at;
}

ChartScene swing() {
  ChartScene s;
  s.name = "swing";
  s.title = "a bar is let go, and swings under its weight (100 x 25 x 25 mm, 60 kPa, Poisson's ratio 0.45)";
  s.answer = "displacement of its end, in 42 moments";
  s.size_m = {0.1, 0.025, 0.025};
  s.young_pa = 60000;
  s.damping_per_s = 2;
  s.gravity_m_per_s2 = 9.81;
  s.cells_per_across = {4, 1, 1};
  s.held = [](const Vec3& p) { return p.x() < kOnFace_m; };
  s.load_s = 1e-9;
  s.duration_s = 0.7;
  s.asked_at_s = moments(0, s.duration_s);
  s.probes.push_back({{0.1, 0.0125, 0.0125}});
  return s;
}

ChartScene release() {
  ChartScene s;
  s.name = "release";
  s.title = "a bar that was pressed together by 8 mm is released (100 x 25 x 25 mm, 30 kPa, Poisson's ratio 0.45)";
  s.answer = "displacement of its end, in 12 moments";
  s.size_m = {0.1, 0.025, 0.025};
  s.damping_per_s = 15;
  s.cells_per_across = {4, 1, 1};
  s.held = [](const Vec3& p) { return p.x() < kOnFace_m || p.x() > 0.1 - kOnFace_m; };
  s.held_at = [](const Vec3& p, double share) -> Vec3 {
    return {p.x() - (p.x() > 0.05 ? share * 0.008 : 0), p.y(), p.z()};
  };
  s.let_go = [](const Vec3& p) { return p.x() > 0.05; };
  s.load_s = 0.15;
  s.let_go_s = 0.2;
  s.duration_s = 0.4;
  s.reference_across = 6;
  s.asked_at_s = moments(s.let_go_s, s.duration_s);
  s.probes.push_back({{0.1, 0.0125, 0.0125}});
  return s;
}

ChartScene cut() {
  ChartScene s;
  s.name = "cut";
  s.title = "a bar that the simulator's knife has cut half through hangs (80 x 10 x 20 mm, 60 kPa, ratio 0.45)";
  s.answer = "displacement along its axis beyond the cut";
  s.size_m = {0.08, 0.01, 0.02};
  s.young_pa = 60000;
  s.gravity_m_per_s2 = 9.81;
  s.cells_per_across = {8, 1, 2};
  s.held = [](const Vec3& p) { return p.x() < kOnFace_m; };
  s.slit = test::Slit{0.02, 0.01};
  s.cut_by_knife = true;
  s.load_s = 1e-9;
  s.duration_s = 1.2;
  s.reference_across = 3;
  for (int i = 2; i <= 8; ++i) s.probes.push_back({{0.08 * i / 8 + (i == 2 ? 1e-4 : 0), 0.005, 0.005}});
  return s;
}

ChartScene hang() {
  ChartScene s;
  s.name = "hang";
  s.title = "a block hangs from its upper side (30 x 30 x 60 mm, 6 kPa, Poisson's ratio 0.45)";
  s.answer = "displacement along its axis";
  s.size_m = {0.03, 0.03, 0.06};
  s.young_pa = 6000;
  s.gravity_m_per_s2 = 9.81;
  s.cells_per_across = {1, 1, 2};
  s.held = [](const Vec3& p) { return p.z() > 0.06 - kOnFace_m; };
  s.load_s = 1e-9;
  s.duration_s = 1;
  for (int i = 0; i < 8; ++i) s.probes.push_back({{0.015, 0.015, 0.06 * i / 8}});
  return s;
}

std::vector<double> answer_of_bricks(const ChartScene& s, int n) {
  const auto& c = s.cells_per_across;
  const test::BrickReference bricks({n * c[0], n * c[1], n * c[2]}, s.size_m, lame(s.young_pa, s.poisson), s.slit);
  std::vector<std::uint8_t> held;
  for (const Vec3& p : bricks.nodes_m()) held.push_back(test::held_if(s.held(p)));
  std::vector<Vec3> load = bricks.body_load_n(Vec3(0, 0, -s.gravity_m_per_s2 * s.density_kg_per_m3));
  std::vector<Vec3> x = bricks.nodes_m();
  constexpr int kParts = 3;
  const double scale_n = s.young_pa * s.size_m.y() * s.size_m.z();
  for (int part = 1; part <= kParts; ++part) {
    std::vector<Vec3> now = load;
    for (Vec3& f : now) f *= double(part) / kParts;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (held[i]) x[i] = s.held_at(bricks.nodes_m()[i], double(part) / kParts);
    x = bricks.equilibrium(x, held, now, 1e-7 * scale_n);
  }
  std::vector<double> answer;
  if (s.asks_torque) {
    const std::vector<Vec3> force = bricks.forces_n(x);
    double torque = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (held[i] && bricks.nodes_m()[i].x() > s.size_m.x() / 2) {
        const Vec3 arm = x[i] - Vec3(x[i].x(), s.size_m.y() / 2, s.size_m.z() / 2);
        torque -= arm.cross(force[i]).x();
      }
    return {torque};
  }
  for (const Probe& probe : s.probes) {
    Vec3 u = bricks.at(probe.rest_m, x) - probe.rest_m;
    if (probe.right) u = bricks.at(probe.rest_m + Vec3(1e-7, 0, 0), x) - Vec3(1e-7, 0, 0) - probe.rest_m - u;
    for (int k = 0; k < 3; ++k) answer.push_back(u[k]);
  }
  return answer;
}

}  // namespace

std::vector<ChartScene> chart_scenes() {
  return {bend(), twist(), indent(), open(), swing(), release(), cut(), hang()};
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

double relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  return distance(a, b) / distance(b, std::vector<double>(b.size(), 0));
}

Reference reference_of(const ChartScene& scene, bool quick) {
  if (scene.ball)
    return {{test::ball_on_layer_n(scene.young_pa, scene.poisson, scene.ball->radius_m, scene.ball->depth_m,
                                   scene.size_m.z())},
            0};
  if (!scene.asked_at_s.empty()) return reference_of_motion(scene, quick);
  const int n = quick ? 3 : scene.reference_across;
  return extrapolated({answer_of_bricks(scene, n - 2), answer_of_bricks(scene, n - 1), answer_of_bricks(scene, n)}, n);
}

Reference extrapolated(const std::array<std::vector<double>, 3>& answers, int n) {
  const auto& [first, second, third] = answers;
  const double ratio = distance(second, first) / distance(third, second);
  const auto gap = [](int m, double p) { return std::pow(m, -p) - std::pow(m + 1, -p); };
  double low = 0.5, high = 6;
  for (int i = 0; i < 50; ++i) {
    const double p = (low + high) / 2;
    (gap(n - 2, p) / gap(n - 1, p) < ratio ? low : high) = p;
  }
  const double left = std::pow(n, -low) / gap(n - 1, low);
  Reference reference{third, 0};
  for (std::size_t i = 0; i < third.size(); ++i) reference.answer[i] += left * (third[i] - second[i]);
  reference.uncertainty = relative_error(third, reference.answer);
  return reference;
}

}  // namespace sectio::chart
