// The largest eigenvalue of M^-1 K by power iteration, for particles with lumped masses.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "common/math/fixed_sequence.h"

namespace sectio {

// stiffness_times(u, f) writes f = K u; K is symmetric. Particles of inverse mass 0 are fixed. The iteration starts
// from fixed_vector(), so that the result is the same everywhere. It is Rayleigh's quotient of the last round, which is
// never above the largest eigenvalue; 0 when nothing can move.
template <class StiffnessTimes>
double largest_eigenvalue(std::span<const double> inverse_mass, int iterations, const StiffnessTimes& stiffness_times) {
  const std::size_t n = inverse_mass.size();
  std::vector<Vec3> u(n), force(n);
  for (std::size_t v = 0; v < n; ++v) u[v] = inverse_mass[v] > 0 ? fixed_vector(v) : Vec3::Zero();
  double eigenvalue = 0;
  for (int i = 0; i < iterations; ++i) {
    stiffness_times(std::span<const Vec3>(u), std::span<Vec3>(force));
    double work = 0, size = 0, scale2 = 0;
    for (std::size_t v = 0; v < n; ++v) {
      if (!(inverse_mass[v] > 0)) continue;
      work += force[v].dot(u[v]);
      size += u[v].squaredNorm() / inverse_mass[v];
      u[v] = inverse_mass[v] * force[v];
      scale2 += u[v].squaredNorm();
    }
    if (!(size > 0) || !(scale2 > 0)) return 0;
    eigenvalue = work / size;
    for (Vec3& x : u) x /= std::sqrt(scale2);
  }
  return eigenvalue;
}

}  // namespace sectio
