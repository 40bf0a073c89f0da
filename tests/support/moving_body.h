// Bodies of every volume model as the simulator has them, for cases in which they move or come to rest under what
// instruments do to them.
#pragma once

#include <functional>
#include <memory>
#include <ostream>
#include <vector>

#include "sim_server/deformation/tetra/volume_model.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {

// One state of what carries the mass: vertices, or lattice nodes.
struct Particle {
  double mass_kg;
  Vec3 x_m, v_m_per_s;
};

class MovingBody {
 public:
  struct Parts {
    std::unique_ptr<VolumeModel> model;
    Points rest;  // rest places of the particles
    std::function<void(const Points& x, std::span<Vec3> force_n)> elastic_forces_n;
    std::function<std::vector<Particle>(const MovingBody&)> particles;
  };
  MovingBody(const TetMesh& m, Parts p) : mesh(m), x(at_rest(m)), v(still(x)), parts(std::move(p)) {}

  void step(int steps = 1, std::span<const PointConstraint> constraints = {});
  double energy_j() const { return parts.model->energy_j(x, v); }
  // After the first step.
  std::vector<Particle> particles() const { return parts.particles(*this); }

  TetMesh mesh;
  Points x, v;  // places and velocities of the vertices
  std::vector<Reaction> reactions;
  Parts parts;
};

struct MovingModel {
  const char* name;
  // The mesh is of cubes as large as `cell_m`, and of these the lattice's cells are.
  std::function<MovingBody::Parts(const TetMesh& mesh, double cell_m, const VolumeMaterial&, const VolumeSettings&)>
      parts;

  MovingBody make(const TetMesh& mesh, double cell_m, const VolumeMaterial& material,
                  const VolumeSettings& settings) const;
};
std::ostream& operator<<(std::ostream& out, const MovingModel& model);

MovingModel moving_springs();
MovingModel moving_tetrahedra();
MovingModel moving_hexahedra();

// A force on a vertex that stays what it is wherever the vertex goes.
PointConstraint dead_load(VertexId v, const Vec3& force_n);

}  // namespace sectio::test
