// The scenes of the chart of error against cost: a box of tissue each, held, loaded, and asked for one answer, which
// the reference (tests/support/brick_reference.h) gives as well. Scenes run until the tissue is at rest, or ask where
// it is at several moments; the error is that of mesh, model, driver and step together.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/math/types.h"
#include "tests/support/brick_reference.h"

namespace sectio::chart {

// Pressed down along -z by a ball whose lowest point goes from the surface to `depth_m` below.
struct Ball {
  double radius_m = 0, depth_m = 0;
  Vec3 beside_m = Vec3::Zero();  // from the middle
  Vec3 centre_m(const Vec3& size_m, double share) const {
    return Vec3(size_m.x() / 2, size_m.y() / 2, size_m.z() + radius_m - share * depth_m) + beside_m;
  }
};

// A point of the tissue that is asked for where it is; `right`: of the two that lie on a slit, the one at larger x.
struct Probe {
  Vec3 rest_m;
  bool right = false;
};

struct ChartScene {
  std::string name, title, answer;  // answer: the measured quantity, with its unit
  Vec3 size_m;
  double young_pa = 30000, poisson = 0.45, density_kg_per_m3 = 1050, damping_per_s = 25;
  double gravity_m_per_s2 = 0;          // along -z
  std::array<int, 3> cells_per_across;  // a mesh n cells across has n times these
  // Whether a point is held, and where it is once the load is on (share 1; 0: at rest).
  std::function<bool(const Vec3& rest_m)> held;
  std::function<Vec3(const Vec3& rest_m, double share)> held_at = [](const Vec3& p, double) { return p; };
  // Whether a point that is held is let go, and when.
  std::function<bool(const Vec3& rest_m)> let_go = [](const Vec3&) { return false; };
  double let_go_s = 0;
  std::optional<Ball> ball;
  std::optional<test::Slit> slit;
  bool cut_by_knife = false;  // the slit of the models is what the simulator's own knife leaves (knife_cut.h)
  int reference_across = 4;   // bricks, of the finest of three meshes
  double load_s = 0.05, duration_s = 1;  // until the load is on, until all is at rest
  std::vector<Probe> probes;             // the answer: their displacements; of a slit: right minus left
  std::vector<double> asked_at_s;        // ... at these moments, one after the other; empty: at rest
  bool asks_torque = false;              // ... instead, about x, of what holds the end at larger x, N m
  bool asks_force = false;               // ... instead, on the ball, N

  double across_m() const { return size_m.minCoeff(); }
  double share(double t_s) const {
    const double s = std::min(1.0, t_s / load_s);
    return s * s * (3 - 2 * s);
  }
};

// bend, twist, indent, open, swing, release, cut, hang.
std::vector<ChartScene> chart_scenes();

// The reference's answer, extrapolated from three meshes, and the distance of its finest mesh from it.
struct Reference {
  std::vector<double> answer;
  double uncertainty = 0;  // relative
};
Reference reference_of(const ChartScene& scene, bool quick);

// The same for a scene that asks for moments: the bricks move in small explicit steps.
Reference reference_of_motion(const ChartScene& scene, bool quick);
// From three meshes, n - 2, n - 1 and n bricks across: the error is taken to be c n^-p, with the p that the differences
// have.
Reference extrapolated(const std::array<std::vector<double>, 3>& answers, int n);

double distance(const std::vector<double>& a, const std::vector<double>& b);
// |a - b| / |b|
double relative_error(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace sectio::chart
