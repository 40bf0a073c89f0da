#include "tests/support/moving_body.h"

#include <utility>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"

namespace sectio::test {

namespace {

template <class Model>
MovingModel moving_vertices(const char* name) {
  return {name, [](const TetMesh& mesh, double, const VolumeMaterial& material, const VolumeSettings& settings) {
            auto model = std::make_unique<Model>(mesh, material, settings);
            const Model* own = model.get();
            return MovingBody::Parts{std::move(model), at_rest(mesh),
                                     [own](const Points& x, std::span<Vec3> f) { own->elastic_forces_n(x, f); },
                                     [own](const MovingBody& body) {
                                       std::vector<Particle> all;
                                       for (VertexId i = 0; i < body.x.size(); ++i)
                                         all.push_back({own->mass_kg(i), body.x[i].head<3>().cast<double>(),
                                                        body.v[i].head<3>().cast<double>()});
                                       return all;
                                     }};
          }};
}
}  // namespace

void MovingBody::step(int steps, std::span<const PointConstraint> constraints) {
  reactions.resize(constraints.size());
  for (int n = 0; n < steps; ++n) parts.model->step(x, v, constraints, reactions);
}

MovingBody MovingModel::make(const TetMesh& mesh, double cell_m, const VolumeMaterial& material,
                             const VolumeSettings& settings) const {
  return {mesh, parts(mesh, cell_m, material, settings)};
}

std::ostream& operator<<(std::ostream& out, const MovingModel& model) {
  return out << model.name;
}

MovingModel moving_springs() {
  return moving_vertices<TetSprings>("tetra_springs");
}

MovingModel moving_tetrahedra() {
  return moving_vertices<TetSolid>("neo_hookean");
}

MovingModel moving_hexahedra() {
  return {"neo_hookean_lattice",
          [](const TetMesh& mesh, double cell_m, const VolumeMaterial& material, const VolumeSettings& settings) {
            auto model = std::make_unique<HexSolid>(mesh, grid_around(mesh, cell_m), material, settings);
            const HexSolid* own = model.get();
            Points rest(own->lattice().nodes.size(), Vec4f::Zero());
            for (std::uint32_t n = 0; n < rest.size(); ++n) rest[n].head<3>() = own->lattice().rest_m(n).cast<float>();
            return MovingBody::Parts{
                std::move(model), rest, [own](const Points& x, std::span<Vec3> f) { own->elastic_forces_n(x, f); },
                [own](const MovingBody&) {
                  std::vector<Particle> all;
                  for (std::size_t n = 0; n < own->node_mass_kg().size(); ++n)
                    all.push_back({own->node_mass_kg()[n], own->node_position_world_m()[n].head<3>().cast<double>(),
                                   own->node_velocity_m_per_s()[n].head<3>().cast<double>()});
                  return all;
                }};
          }};
}

PointConstraint dead_load(VertexId v, const Vec3& force_n) {
  PointConstraint pull = hold(v, 1e6 * force_n.normalized());
  pull.largest_force_n = force_n.norm();
  return pull;
}

}  // namespace sectio::test
