// Statics of a body under its weight, for small strains: K u = m g with the stiffness K at rest. Conjugate gradients,
// preconditioned by the 3 x 3 blocks of the diagonal. Deterministic, one thread.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/math/types.h"

namespace sectio {

class ElasticEnergy;

// A particle that is free, in the frame of the body at rest.
struct SagPoint {
  Vec3 rest_m = Vec3::Zero(), moved_m = Vec3::Zero();
  double mass_kg = 0;
};

// Spans have one entry a particle.
struct SagProblem {
  std::span<const double> mass_kg, inverse_mass_per_kg;  // masses of the tissue; inverse 0: held
  Vec3 gravity_m_per_s2 = Vec3::Zero();
  std::vector<Mat3> blocks_n_per_m;  // the diagonal of K
  // Adds K p. Fourth components are scratch.
  std::function<void(std::span<Vec4f> p_m, std::span<Vec4f> force_n)> add_product;
};

// The displacements; empty when they are without bounds, as of a body that nothing holds.
std::vector<Vec3> sag_m(const SagProblem& problem);
// The same, for an energy whose body is at rest at `rest_m`.
std::vector<Vec3> sag_m(ElasticEnergy& energy, std::span<const Vec3> rest_m, std::span<const double> mass_kg,
                        std::span<const double> inverse_mass_per_kg, const Vec3& gravity_m_per_s2);

}  // namespace sectio
