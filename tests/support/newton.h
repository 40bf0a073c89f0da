// Bodies at rest in double precision: Newton's method with a line search on the energy.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "common/math/lame.h"
#include "common/math/types.h"

namespace sectio::test {

Mat3 cofactor(const Mat3& f);

// The coordinates of a point that are held: the sum of kHeldX, kHeldY and kHeldZ.
constexpr std::uint8_t kHeldX = 1, kHeldY = 2, kHeldZ = 4, kHeldAll = 7;
std::uint8_t held_if(bool condition);

// An elastic body as a function of the places of its points.
class ElasticReference {
 public:
  using Points = std::vector<Vec3>;
  using Sparse = Eigen::SparseMatrix<double>;

  virtual ~ElasticReference() = default;
  virtual double energy_j(const Points& x) const = 0;
  virtual Points forces_n(const Points& x) const = 0;  // minus the gradient of the energy
  virtual Sparse hessian(const Points& x) const = 0;   // Hessian of the energy
};

// The body at rest under `load_n`, from the start `x`; the held coordinates of its points stay as they are there.
std::vector<Vec3> newton_equilibrium(const ElasticReference& model, std::vector<Vec3> x,
                                     const std::vector<std::uint8_t>& held, const std::vector<Vec3>& load_n,
                                     double tolerance_n);

}  // namespace sectio::test
