#include "sim_server/deformation/sag.h"

#include <Eigen/LU>
#include <cmath>

#include "sim_server/deformation/newton_step.h"

namespace sectio {
namespace {

constexpr double kSagTolerance = 2e-3;  // share of the displacement that is left, in the norm of K
constexpr int kSagDelay = 12;           // products over which the energy's decrease is looked at
constexpr int kMostOfSag = 1500;

double dot(std::span<const Vec3> a, std::span<const Vec3> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

}  // namespace

// The squared error in the norm of K is the sum of alpha r.z over all products to come (Hestenes and Stiefel 1952),
// of which the last ones tell.
std::vector<Vec3> sag_m(const SagProblem& problem) {
  const std::size_t n = problem.mass_kg.size();
  std::vector<Mat3> inverse(n, Mat3::Zero());
  std::vector<Vec3> u(n, Vec3::Zero()), r = u, z = u, p = u, kp = u;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(problem.inverse_mass_per_kg[i] > 0) || !(problem.blocks_n_per_m[i].trace() > 0)) continue;
    inverse[i] = problem.blocks_n_per_m[i].inverse();
    r[i] = problem.mass_kg[i] * problem.gravity_m_per_s2;
  }
  std::vector<Vec4f> p_float(n, Vec4f::Zero()), kp_float = p_float;
  std::vector<double> gains;
  double total = 0, rz = 0;
  const auto precondition = [&] {
    for (std::size_t i = 0; i < n; ++i) z[i] = inverse[i] * r[i];
    return dot(r, z);
  };
  rz = precondition();
  if (rz == 0) return u;
  p = z;
  while (static_cast<int>(gains.size()) < kMostOfSag) {
    for (std::size_t i = 0; i < n; ++i) p_float[i].head<3>() = p[i].cast<float>();
    std::ranges::fill(kp_float, Vec4f::Zero());
    problem.add_product(p_float, kp_float);
    for (std::size_t i = 0; i < n; ++i) {
      kp[i] = kp_float[i].head<3>().cast<double>();
      if (inverse[i](0, 0) == 0) kp[i].setZero();
    }
    const double pkp = dot(p, kp);
    if (!(pkp > 0)) return {};
    const double alpha = rz / pkp;
    for (std::size_t i = 0; i < n; ++i) {
      u[i] += alpha * p[i];
      r[i] -= alpha * kp[i];
    }
    gains.push_back(alpha * rz);
    total += gains.back();
    const double next = precondition();
    double last = 0;
    for (std::size_t k = gains.size() - std::min<std::size_t>(gains.size(), kSagDelay); k < gains.size(); ++k)
      last += gains[k];
    if (!(next > 0) || (gains.size() >= kSagDelay && last <= kSagTolerance * kSagTolerance * total)) return u;
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + next / rz * p[i];
    rz = next;
  }
  return {};
}

std::vector<Vec3> sag_m(ElasticEnergy& energy, std::span<const Vec3> rest_m, std::span<const double> mass_kg,
                        std::span<const double> inverse_mass_per_kg, const Vec3& gravity_m_per_s2) {
  SagProblem problem{mass_kg, inverse_mass_per_kg, gravity_m_per_s2, std::vector<Mat3>(rest_m.size(), Mat3::Zero()),
                     [&](std::span<Vec4f> p_m, std::span<Vec4f> force_n) { energy.add_product(p_m, force_n); }};
  energy.linearise(rest_m);
  energy.add_blocks(problem.blocks_n_per_m);
  return sag_m(problem);
}

}  // namespace sectio
