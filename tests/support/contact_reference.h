// Rigid indenters without friction on an elastic layer that is bonded to its ground.
#pragma once

namespace sectio::test {

double contact_modulus_pa(double young_pa, double poisson);

// The force of a ball: Hertz's force times the series of Dimitriadis et al. (2002) in chi = sqrt(R d) / H, for any
// Poisson's ratio.
double ball_on_layer_n(double young_pa, double poisson, double radius_m, double depth_m, double height_m);

// The force of a flat punch of radius a: Boussinesq's F = 2 a E* d times what the ground adds (Hayes et al. 1972), from
//   phi(t) - 2 / (pi h) int_0^1 phi(u) int_0^inf (1 - M(s)) cos(s t / h) cos(s u / h) ds du = 1,  h = H / a,
//   M(s) = (k sinh 2s - 2s) / (k cosh 2s + 2 s^2 + (1 + k^2) / 2),  k = 3 - 4 nu,  factor = int_0^1 phi
double punch_on_layer_factor(double radius_over_height, double poisson);

}  // namespace sectio::test
