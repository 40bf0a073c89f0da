// Bodies at rest for the cases of the accuracy suite: the elements of one model in double precision, which a test of
// its own compares with the fast kernels, loaded and held by their particles (vertices or lattice nodes), asked by the
// vertices of the tetrahedra that these carry.
#pragma once

#include <functional>
#include <ostream>
#include <vector>

#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/newton.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {

// Springs between vertices: E = sum k (l - l0)^2 / 2.
class SpringReference final : public ElasticReference {
 public:
  explicit SpringReference(std::vector<TetSprings::Spring> springs) : springs_(std::move(springs)) {}

  double energy_j(const Points& x) const override;
  Points forces_n(const Points& x) const override;
  Sparse hessian(const Points& x) const override;

 private:
  std::vector<TetSprings::Spring> springs_;
};

struct StaticBody {
  using Points = std::vector<Vec3>;
  struct Share {
    std::size_t particle;
    double weight;
  };

  TetMesh mesh;
  Points rest_m;                           // rest places of the particles
  std::vector<double> volume_m3;           // volume of each particle, as its mass is
  std::vector<std::vector<Share>> riding;  // by vertex: on which particles
  std::function<Points(const Points& x, const std::vector<std::uint8_t>& held, const Points& load_n,
                       double tolerance_n)>
      equilibrium;
  std::function<Points(const Points& x)> forces_n;  // forces of the tissue on its particles

  Vec3 at(VertexId v, const Points& x) const;
  Vec3 displacement_m(VertexId v, const Points& x) const { return at(v, x) - mesh.vertices_body_m[v]; }
  Points on_particles(const Points& on_vertices) const;
};

// For each vertex its share of the surface's triangles whose three corners `on` accepts; the sum is their area.
std::vector<double> areas_of_vertices_m2(const TetMesh& mesh, const std::function<bool(const Vec3&)>& on);

// A model as the cases take it. The mesh is of cubes as large as `cell_m`, and of these the lattice's cells are;
// `whole`: what it was before it was cut.
struct StaticModel {
  const char* name;
  BoxLattice lattice = BoxLattice::five;
  std::function<StaticBody(const TetMesh& whole, const TetMesh& mesh, double cell_m, double young_pa, double poisson)>
      make;
};
std::ostream& operator<<(std::ostream& out, const StaticModel& model);

// tetra_springs: its Poisson's ratio is that of springs, whatever is asked for. Calibrated on the whole body.
StaticModel tetra_springs();
// neo_hookean, and two alternatives: with a pressure of each element, and this on a lattice of six tetrahedra a cube.
StaticModel neo_hookean(bool nodal_pressure = true, BoxLattice lattice = BoxLattice::five);
// neo_hookean_lattice; `beside`: the distance of the cells' faces from the body's, in cells.
StaticModel neo_hookean_lattice(double beside = 0);

}  // namespace sectio::test
