// The model neo_hookean: stable neo-Hookean tetrahedra with averaged nodal pressure (tet_kernel.h has the energy). Two
// integrators (explicit_implicit_integrator.h): symplectic Euler in as many equal substeps as stability requires, and
// Newton's method (tet_energy.h), with vertex block descent where it fails. Deterministic, one thread.
#pragma once

#include "sim_server/deformation/tetra/explicit_implicit_integrator.h"
#include "sim_server/deformation/tetra/tet_energy.h"
#include "sim_server/deformation/tetra/tet_kernel.h"

namespace sectio {

class TetSolid final : public ExplicitImplicitIntegrator {
 public:
  TetSolid(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
           VolumeIntegrator integrator = VolumeIntegrator::automatic);

  void change(const TetChange& change) override;
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints, std::span<Reaction> reactions) override;

  double mass_kg(VertexId v) const override { return body_.mass_kg(v); }
  double inverse_mass_per_kg(VertexId v) const override { return body_.inverse_mass()[v]; }
  IntegratorDiagnostics diagnostics() const override {
    IntegratorDiagnostics d = ExplicitImplicitIntegrator::diagnostics();
    d.added_mass_fraction = body_.added_mass_fraction();
    return d;
  }
  bool asks_for_origins() const override { return body_.has_stiffness_factors(); }
  VertexId first_bad_vertex() const override { return first_bad_vertex_; }
  void restore(std::span<const Vec4f>, const Pose&, std::span<Vec4f>, std::span<Vec4f>) override {
    first_bad_vertex_ = kNone;
    driver_.forget();
  }
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const override {
    return elastic_energy_j(position_world_m) + energy_of_motion_j(position_world_m, velocity_m_per_s);
  }
  // The elastic energy, and the forces that the kernels compute, on fixed vertices, too. O(n); for tests and reports.
  double elastic_energy_j(std::span<const Vec4f> position_world_m) const;
  void elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const;

  void archive(Archive& a) override {
    archive_integrator(a);
    a(body_, stiffness_, rows_, omega2_per_bound_, first_bad_vertex_);
    if (!a.reads()) return;
    energy_.changed();
    scratch_.resize(3 * rows_.most_faces() + 1);
  }
  const TetRows& rows() const { return rows_; }
  const TetMesh& mesh() const override { return body_.mesh(); }

  std::vector<Vec3> sag_m(const Vec3& gravity_body_m_per_s2) override;

  // The energy of the implicit driver.
  TetEnergy& energy() { return energy_; }
  const ImplicitDriver& driver() const { return driver_; }
  // The objective that an implicit step minimises: sum_i m_i |x_i - y_i|^2 / (2 h^2) + elastic energy.
  double objective_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> inertial_world_m,
                     double step_s) const;

 private:
  void implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                     std::span<const PointConstraint> constraints, std::span<Reaction> reactions);
  void smooth(double step_s, std::span<const Vec3> inertial_world_m, std::span<Vec3> position_world_m);
  bool explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);

  void weigh(VertexId v, const VertexStar& star, double substep_s);
  void divide();
  TetVertex row_of(VertexId v) const;

  TetBody body_;
  TetStiffness stiffness_;
  TetRows rows_;
  TetEnergy energy_{body_, stiffness_, rows_};
  VertexStar star_;  // scratch
  double omega2_per_bound_ = 0;
  VertexId first_bad_vertex_ = kNone;
  bool has_changed_ = false;  // since the last step; rows are laid out anew in steps without a change

  DividedConstraints constraints_;
  ConstraintSupports corners_;
  std::vector<Vec4f> start_position_, start_velocity_, inertial_, smoothed_;
  std::vector<double> masses_;
  std::vector<TetBlockColumn> scratch_;  // aligned floats
};

// The bound sum_b |K_ib| of a vertex, N/m: omega^2 is at most the largest ratio of the bound to the vertex's mass, for
// linear elements at rest, and so for those with nodal pressures, which are softer. The bound is rigorous; the true
// limit of the step is 1.4 to 1.9 times as large for the former, 2 to 2.5 times for the latter.
double stiffness_bound_n_per_m(const VertexStar& star, const TetStiffness& stiffness);

// The largest omega^2 (1/s^2) of the solid at rest with these masses (inverse mass 0: fixed), by power iteration: never
// above the true one, and a few percent below it.
double largest_omega2_at_rest(const TetMesh& mesh, const TetStiffness& stiffness, std::span<const double> inverse_mass,
                              int iterations = 200);

}  // namespace sectio
