// Stable neo-Hookean tetrahedra once more, in double precision and as plainly as possible: the energy of tet_kernel.h,
// its gradient and Hessian, with averaged nodal pressure or a pressure in each element, and Newton's method for bodies
// at rest. The fast models are compared with it.
#pragma once

#include <functional>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/tetra/tet_star.h"
#include "tests/support/newton.h"

namespace sectio::test {

class TetReference final : public ElasticReference {
 public:
  TetReference(const TetMesh& mesh, const Lame& material, bool nodal_pressure = true);

  const TetMesh& mesh() const { return mesh_; }

  Mat3 gradient(std::size_t t, const Points& x) const;

  double energy_j(const Points& x) const override;

  Points forces_n(const Points& x) const override;

  // kappa times the volume strain, of each tetrahedron.
  std::vector<double> pressures(const Points& x) const;

  Sparse hessian(const Points& x) const override;

  Points equilibrium(const Points& x, const std::vector<std::uint8_t>& held, const Points& load,
                     double tolerance_n = 1e-9) const;

 private:
  struct Change {
    void add(VertexId v, const Vec3& g);
    std::vector<std::pair<VertexId, Vec3>> by_vertex;
  };

  static double sign(std::size_t a, std::size_t b, std::size_t p, std::size_t q);

  TetMesh mesh_;
  double mu_, kappa_;
  bool nodal_;
  std::vector<TetShape> shape_;
  std::vector<double> rest_volume_;
};

}  // namespace sectio::test
