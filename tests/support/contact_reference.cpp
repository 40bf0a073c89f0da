#include "tests/support/contact_reference.h"

#include <Eigen/Dense>
#include <cmath>

namespace sectio::test {

double contact_modulus_pa(double young_pa, double poisson) {
  return young_pa / (1 - poisson * poisson);
}

double ball_on_layer_n(double young_pa, double poisson, double radius_m, double depth_m, double height_m) {
  const double chi = std::sqrt(radius_m * depth_m) / height_m, nu = poisson, pi = M_PI;
  const double a = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1 - nu);
  const double b = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1 - nu);
  return 4.0 / 3 * contact_modulus_pa(young_pa, nu) * std::sqrt(radius_m) * std::pow(depth_m, 1.5) *
         (1 - 2 * a / pi * chi + 4 * a * a / (pi * pi) * chi * chi -
          8 / (pi * pi * pi) * (a * a * a + 4 * pi * pi * b / 15) * std::pow(chi, 3) +
          16 * a / std::pow(pi, 4) * (a * a * a + 3 * pi * pi * b / 5) * std::pow(chi, 4));
}

double punch_on_layer_factor(double radius_over_height, double poisson) {
  constexpr int kPoints = 40, kWaves = 400;
  constexpr double kLongest = 20;  // 1 - M(s) falls with exp(-2 s)
  const double h = 1 / radius_over_height, k = 3 - 4 * poisson;
  const auto middle = [](int i, int of) { return (i + 0.5) / of; };
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(kPoints, kPoints);
  for (int n = 0; n < kWaves; ++n) {
    const double s = kLongest * middle(n, kWaves);
    const double m = (k * std::sinh(2 * s) - 2 * s) / (k * std::cosh(2 * s) + 2 * s * s + 0.5 * (1 + k * k));
    Eigen::VectorXd wave(kPoints);
    for (int i = 0; i < kPoints; ++i) wave[i] = std::cos(s * middle(i, kPoints) / h);
    system -= 2 / (M_PI * h) * (1 - m) * kLongest / kWaves / kPoints * wave * wave.transpose();
  }
  return system.partialPivLu().solve(Eigen::VectorXd::Ones(kPoints)).mean();
}

}  // namespace sectio::test
