// The reference of scenes that move: triquadratic bricks with lumped masses, which Simpson's rule gives, in double
// precision. Steps are a third of what the fastest wave takes from node to node, far shorter than those of any model.
#include <algorithm>
#include <cmath>

#include "tests/chart/scene.h"

namespace sectio::chart {
namespace {

constexpr double kOfWave = 0.3;

class MovingBricks {
 public:
  MovingBricks(const ChartScene& scene, int n)
      : scene_(scene),
        bricks_({n * scene.cells_per_across[0], n * scene.cells_per_across[1], n * scene.cells_per_across[2]},
                scene.size_m, lame(scene.young_pa, scene.poisson)),
        x_(bricks_.nodes_m()),
        v_(x_.size(), Vec3::Zero()) {
    for (const Vec3& load : bricks_.body_load_n(Vec3(0, 0, scene.density_kg_per_m3))) mass_kg_.push_back(load.z());
    const Lame material = lame(scene.young_pa, scene.poisson);
    const double wave = std::sqrt((material.lambda_pa + 2 * material.mu_pa) / scene.density_kg_per_m3);
    most_step_s_ = kOfWave * scene.across_m() / (2 * n) / wave;
  }

  std::vector<double> answer() {
    std::vector<double> all;
    for (const double at_s : scene_.asked_at_s) {
      if (t_s_ < scene_.let_go_s) run_to(std::min(at_s, scene_.let_go_s));
      run_to(at_s);
      for (const Probe& probe : scene_.probes) {
        const Vec3 u = bricks_.at(probe.rest_m, x_) - probe.rest_m;
        all.insert(all.end(), u.data(), u.data() + 3);
      }
    }
    return all;
  }

 private:
  void run_to(double end_s) {
    if (end_s <= t_s_) return;
    const double from_s = t_s_;
    const int steps = static_cast<int>(std::ceil((end_s - from_s) / most_step_s_));
    const double h = (end_s - from_s) / steps;
    const bool released = from_s >= scene_.let_go_s;
    for (int n = 1; n <= steps; ++n) step(h, t_s_ = from_s + n * h, released);
  }

  void step(double h, double t_s, bool released) {
    const Vec3 gravity(0, 0, -scene_.gravity_m_per_s2);
    const std::vector<Vec3> force = bricks_.forces_n(x_);
    const double damped = std::exp(-scene_.damping_per_s * h);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const Vec3& rest = bricks_.nodes_m()[i];
      if (scene_.held(rest) && !(released && scene_.let_go(rest))) {
        x_[i] = scene_.held_at(rest, scene_.share(t_s));
        v_[i].setZero();
        continue;
      }
      v_[i] = damped * v_[i] + h * (force[i] / mass_kg_[i] + gravity);
      x_[i] += h * v_[i];
    }
  }

  const ChartScene& scene_;
  test::BrickReference bricks_;
  std::vector<Vec3> x_, v_;
  std::vector<double> mass_kg_;
  double t_s_ = 0, most_step_s_ = 0;
};

}  // namespace

Reference reference_of_motion(const ChartScene& scene, bool quick) {
  const int n = quick ? 3 : scene.reference_across;
  std::array<std::vector<double>, 3> answers;
  for (int i = 0; i < 3; ++i) answers[static_cast<std::size_t>(i)] = MovingBricks(scene, n - 2 + i).answer();
  return extrapolated(answers, n);
}

}  // namespace sectio::chart
