// Model M4: lattice hexahedra with virtual nodes (hex_lattice.h, hex_kernel.h) that carry a mesh of tetrahedra, whose
// vertices are what the engine moves. Two drivers (two_drivers.h): the bound of the explicit one holds in any state and
// is not changed by cuts; more parts, up to four times as many, where deformation has stiffened the body; beyond that,
// block descent. Deterministic, one thread.
#pragma once

#include <memory>

#include "sim_server/deformation/held_points.h"
#include "sim_server/deformation/hexa/hex_descent.h"
#include "sim_server/deformation/tetra/explicit_implicit_integrator.h"
#include "sim_server/deformation/tetra/tet_body.h"

namespace sectio {

class HexSolid final : public ExplicitImplicitIntegrator {
 public:
  // `from`: what this is a part of, whose nodes pass their state on. settings.least_part_s isn't needed. A fixed vertex
  // holds the node next to it, and what lies between four fixed corners of a tetrahedron.
  HexSolid(const TetMesh& mesh, const Grid& grid, const VolumeMaterial& material, VolumeSettings settings,
           TetDriver driver = TetDriver::automatic, const HexSolid* from = nullptr);

  // Copies of cells are divided, their nodes pass their state on; the stable step stays. O(n), the costly part of it
  // O(change).
  void change(const TetChange& change) override;

  // What has happened to vertices since the last step was done by impulses, which their nodes get.
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints, std::span<Reaction> reactions) override;

  const TetMesh& mesh() const override { return body_.mesh(); }
  double mass_kg(VertexId v) const override { return body_.mass_kg(v); }
  // As if each vertex of the surface had its share of its nodes' masses: impulses to any number of them, each found as
  // if it were alone, together never make a node faster than what hit it.
  double inverse_mass_per_kg(VertexId v) const override { return vertex_inverse_[v]; }
  VertexId first_bad_vertex() const override { return bad_ ? VertexId{0} : kNone; }
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const override;

  // Of the last step; parts() as long as nothing is stretched much.
  int last_parts() const { return last_parts_; }

  const HexLattice& lattice() const { return *lattice_; }
  const HexRows& rows() const { return rows_; }
  const HexMaterial& material() const { return hex_material_; }
  std::span<const double> node_mass_kg() const { return node_mass_; }
  std::span<const Vec4f> node_position_world_m() const { return position_; }
  std::span<const Vec4f> node_velocity_m_per_s() const { return velocity_; }
  double elastic_energy_j(std::span<const Vec4f> node_position_world_m) const;
  void elastic_forces_n(std::span<const Vec4f> node_position_world_m, std::span<Vec3> force_n) const;
  // Of a vertex that rides on these nodes.
  Vec3 carried(VertexId v, std::span<const Vec4f> nodes) const;

 private:
  void build();
  void find_held();
  void share_masses();
  void invert_masses();
  void inherit(const HexLattice& lattice, std::span<const std::uint32_t> from, const std::vector<double>& free_mass,
               const std::vector<Vec4f>& position, const std::vector<Vec4f>& velocity,
               const std::vector<Vec4f>& last_velocity);
  // Before the first step: a rigid body's nodes go along, of one that is deformed each with the vertices around it.
  void place(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s);
  // A cut makes vertices where they are in the world, on straight edges: they ride there, a little beside where they
  // are at rest, so that the next cut goes on from where this one ends.
  void bind_new(std::span<const Vec4f> position_world_m);
  void weigh_corners(VertexId v);
  void take_over(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s);
  void write_vertices(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);
  void support(std::span<const PointConstraint> constraints);
  // Parts that would have been needed, 0 when the step was taken.
  int explicit_step(int parts);
  void implicit_step(std::span<const PointConstraint> constraints);

  TetBody body_;
  HexMaterial hex_material_;
  LatticeMaker maker_;
  std::unique_ptr<HexLattice> lattice_;
  std::unique_ptr<HexDescent> descent_;
  HexRows rows_;
  std::vector<double> node_mass_, free_mass_, inverse_mass_;  // the latter two 0 when held
  std::vector<float> inverse_mass_float_;
  std::vector<double> vertex_inverse_;
  std::vector<std::array<float, 8>> weight_;  // of the vertices
  std::vector<Vec3> beside_;                  // of the vertices: where they ride less where they are at rest, in cells
  std::size_t bound_ = 0;                     // vertices of which that is known
  int last_parts_ = 1;
  bool bad_ = false, placed_ = false;

  std::vector<Vec4f> position_, velocity_, force_;  // of the nodes
  std::vector<Vec4f> written_position_, written_velocity_;
  std::vector<Vec4f> start_position_, start_velocity_, last_velocity_;
  std::vector<Vec3> inertial_, target_;
  ConstraintSupports supports_;
  DividedConstraints constraints_;
  HeldPoints held_;
};

}  // namespace sectio
