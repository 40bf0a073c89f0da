// The energy of the neo-Hookean solid (tet_kernel.h) for the implicit driver, and its exact Hessian. With n_k^e the
// gradient of the volume of tetrahedron e for its corner k, P_i = kappa_i (J_i - 1) / 4 the share of a vertex in the
// pressures of its tetrahedra, and D_i = dP_i / d(volume around i):
//
//   K = L (x) I + sum_e c_e d2V_e + G^T D G,   c_e = sum of P over e's corners - mu_e,   G_ij = sum_{e at i, j} n_j^e
//
// c_e is kept within -mu_e and mu_e, which makes K positive where a body is crushed or turned inside out. The share of
// the pressure reaches two edges far; as a product it is two passes over the half-edges (tet_hessian.h). All but the
// energy is computed from the rows, in single precision, from differences of positions in twice that.
#pragma once

#include <vector>

#include "sim_server/deformation/newton_step.h"
#include "sim_server/deformation/tetra/tet_body.h"
#include "sim_server/deformation/tetra/tet_hessian.h"

namespace sectio {

class TetEnergy final : public ElasticEnergy {
 public:
  // The arguments must outlive this object.
  TetEnergy(const TetBody& body, const TetStiffness& stiffness, const TetRows& rows)
      : body_(&body), stiffness_(&stiffness), rows_(&rows) {}
  // Call after a change of the tetrahedra.
  void changed();

  double energy_j(std::span<const Vec3> position_world_m) override;  // after a change O(all)
  void add_forces(std::span<const Vec3> position_world_m, std::span<Vec3> force_n) override;
  double rounding_n() const override { return rounding_n_; }
  void linearise(std::span<const Vec3> position_world_m) override;
  void add_product(std::span<Vec4f> p_m, std::span<Vec4f> force_n) const override;
  void add_blocks(std::span<Mat3> blocks_n_per_m) const override;
  std::uint64_t changes() const override { return changes_; }
  ParticleGraph graph() const override;
  void add_to(RigidAggregates& coarse) const override;

 private:
  struct Element {
    Tetrahedron corners;
    std::array<Vec3, 4> gradient;
    double volume_m3, shear_pa;
  };
  struct Vertex {
    double rest_m3 = 0, bulk_j = 0;  // sums over the tetrahedra: volume, and kappa times volume
    double volume_m3 = 0;
  };
  void build();
  void place(std::span<const Vec3> x);

  const TetBody* body_;
  const TetStiffness* stiffness_;
  const TetRows* rows_;
  std::uint64_t changes_ = 1;
  bool stale_ = true;
  std::vector<Element> elements_;
  std::vector<Vertex> vertices_;
  std::vector<Vec4f> position_, low_, force_;  // position_: with pressures
  double rounding_n_ = 0;
  TetHessian hessian_;
};

}  // namespace sectio
