// The model neo_hookean_lattice: lattice hexahedra with virtual nodes (hex_lattice.h, hex_kernel.h), in which the
// vertices of a mesh of tetrahedra are embedded. Two integrators (explicit_implicit_integrator.h): the bound of the
// explicit one holds in any state, and cuts don't change it. A body that deformation has stiffened takes up to
// four times as many substeps; beyond that, the implicit driver takes the step. Deterministic, one thread.
#pragma once

#include <memory>

#include "sim_server/deformation/hexa/hex_descent.h"
#include "sim_server/deformation/tetra/explicit_implicit_integrator.h"
#include "sim_server/deformation/tetra/tet_body.h"

namespace sectio {

class HexSolid final : public ExplicitImplicitIntegrator {
 public:
  // `from`: the solid that this is a part of; its nodes pass their state on. settings.least_substep_s isn't used. A
  // triangle of the surface with three fixed corners is held (clamps_of()), a tetrahedron with four fixes the nodes in
  // its box, and a fixed vertex of neither fixes the node nearest to it.
  HexSolid(const TetMesh& mesh, const Grid& grid, const VolumeMaterial& material, VolumeSettings settings,
           VolumeIntegrator integrator = VolumeIntegrator::automatic, const HexSolid* from = nullptr);

  // Divides copies of cells, whose nodes pass their state on; the stable step stays. O(n), of which the costly part is
  // O(change).
  void change(const TetChange& change) override;

  // Changes of the vertices since the last step are taken for the effect of impulses, which act on their nodes.
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints, std::span<Reaction> reactions) override;

  const TetMesh& mesh() const override { return body_.mesh(); }
  double cell_m() const override { return lattice_->grid.cell_m; }
  ModelSize size() const override {
    ModelSize size = ExplicitImplicitIntegrator::size();
    size.elements = static_cast<double>(lattice_->cells.size());
    return size;
  }
  double mass_kg(VertexId v) const override { return body_.mass_kg(v); }
  // Each vertex of the surface counts as if it had its own share of its nodes' masses. So impulses on many vertices,
  // each computed as if it were alone, together never make a node faster than the object that hit it.
  double inverse_mass_per_kg(VertexId v) const override { return vertex_inverse_[v]; }
  void nodes_of(VertexId v, std::vector<NodeShare>& nodes) const override;
  std::uint32_t node_count() const override { return static_cast<std::uint32_t>(position_.size()); }
  NodeMotion node(std::span<const Vec4f>, std::uint32_t n) const override {
    return {velocity_[n].head<3>().cast<double>(), inverse_mass_[n]};
  }
  void nudge(std::span<const NodeChange> changes, std::span<Vec4f> position_world_m,
             std::span<Vec4f> velocity_m_per_s) override;
  VertexId first_bad_vertex() const override { return bad_ ? VertexId{0} : kNone; }
  void save(std::vector<Vec4f>& nodes_world_m) const override { nodes_world_m = position_; }
  void restore(std::span<const Vec4f> nodes_world_m, const Pose& frame, std::span<Vec4f> position_world_m,
               std::span<Vec4f> velocity_m_per_s) override;
  IntegratorDiagnostics diagnostics() const override;
  std::vector<Vec3> sag_m(const Vec3& gravity_body_m_per_s2) override;
  std::vector<Vec3> sag_of_nodes_m(const Vec3& gravity_body_m_per_s2);  // sag of the nodes of the lattice
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const override;

  void archive(Archive& a) override;

  // Substeps of the last step; equal to substeps() as long as nothing is stretched much.
  int last_substeps() const { return last_substeps_; }

  const HexLattice& lattice() const { return *lattice_; }
  const HexRows& rows() const { return rows_; }
  HexDescent& energy() { return *descent_; }  // for the implicit driver
  const HexMaterial& material() const { return hex_material_; }
  std::span<const double> node_mass_kg() const { return node_mass_; }
  std::span<const double> node_inverse_mass_per_kg() const { return inverse_mass_; }  // 0: held
  std::span<const Vec4f> node_position_world_m() const { return position_; }
  std::span<const Vec4f> node_velocity_m_per_s() const { return velocity_; }
  double elastic_energy_j(std::span<const Vec4f> node_position_world_m) const;
  void elastic_forces_n(std::span<const Vec4f> node_position_world_m, std::span<Vec3> force_n) const;
  // The value at a vertex, interpolated from values at the nodes.
  Vec3 carried(VertexId v, std::span<const Vec4f> nodes) const;

 private:
  void build();
  LatticeMaker::IsFixed is_fixed() const;
  void hold_nodes(double omega2);
  void find_held(std::vector<std::uint8_t>& held) const;
  void share_masses();
  void invert_masses();
  void inherit(const HexLattice& lattice, std::span<const std::uint32_t> from, const std::vector<Vec4f>& position,
               const std::vector<Vec4f>& velocity);
  // Brings the nodes up to date with what has been done to vertices since they were written.
  void take_up(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) {
    if (!placed_) place(position_world_m, velocity_m_per_s);
    bind_new(position_world_m);
    read_vertices(position_world_m, velocity_m_per_s);
  }
  // Before the first step: places the nodes by the rigid motion of the body, then each with the vertices around it.
  void place(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s);
  // A cut makes vertices on straight edges in the world. They are embedded at these places, which differ a little from
  // their rest places in the cell, so that the next cut continues where this one ended.
  void bind_new(std::span<const Vec4f> position_world_m);
  void weigh_corners(VertexId v);
  void read_vertices(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s);
  void write_vertices(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);
  void support(std::span<const PointConstraint> constraints);
  // Returns 0 if the step was taken, else the number of substeps that it needs.
  int explicit_step(int substeps);
  void implicit_step(std::span<const PointConstraint> constraints, std::span<Reaction> reactions);

  TetBody body_;
  HexMaterial hex_material_;
  LatticeMaker maker_;
  std::unique_ptr<HexLattice> lattice_;
  std::unique_ptr<HexDescent> descent_;
  HexRows rows_;
  struct Added {
    std::uint32_t node;
    float kg;
  };
  std::vector<Added> weightless_;  // mass that stability has added, on which gravity doesn't act
  double added_mass_fraction_ = 0;
  std::vector<double> node_mass_, free_mass_, inverse_mass_;  // the latter two are 0 for fixed nodes
  std::vector<float> inverse_mass_float_;
  std::vector<double> vertex_inverse_;
  std::vector<std::array<float, 8>> weight_;  // by vertex
  std::vector<Vec3> beside_;                  // by vertex: place of embedding minus rest place, in cells
  std::size_t bound_ = 0;                     // vertices that have been embedded
  int last_substeps_ = 1;
  bool bad_ = false, placed_ = false;
  Pose rest_world_;  // pose of the lattice at rest, by its place before the first step

  std::vector<Vec4f> position_, velocity_, force_;  // by node
  std::vector<Vec4f> written_position_, written_velocity_;
  std::vector<Vec4f> start_position_, start_velocity_;
  ConstraintSupports supports_;
  DividedConstraints constraints_;
};

}  // namespace sectio
