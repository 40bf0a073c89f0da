// Lame's constants of an isotropic elastic solid, Pa.
#pragma once

namespace sectio {

struct Lame {
  double mu_pa, lambda_pa;
};

inline Lame lame(double young_pa, double poisson) {
  const double mu = young_pa / (2 * (1 + poisson));
  return {mu, 2 * mu * poisson / (1 - 2 * poisson)};
}

}  // namespace sectio
