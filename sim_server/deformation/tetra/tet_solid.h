// Model M3: stable neo-Hookean tetrahedra with averaged nodal pressure (tet_kernel.h has the energy). Two drivers on
// the same data: an explicit one (symplectic Euler in equal parts of the step, as many as its stability asks for),
// watched by a bound on the largest frequency; and vertex block descent, implicit and stable at any step. A step that
// the explicit driver could not take safely is taken back and done by the implicit one; then the explicit one goes on.
// Deterministic, one thread.
#pragma once

#include "sim_server/deformation/held_points.h"
#include "sim_server/deformation/tetra/tet_body.h"
#include "sim_server/deformation/tetra/tet_kernel.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

enum class TetDriver { automatic, implicit_only };

class TetSolid final : public VolumeModel {
 public:
  TetSolid(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
           TetDriver driver = TetDriver::automatic);

  void change(const TetChange& change) override;
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints, std::span<Reaction> reactions) override;
  const Vec3& gravity_m_per_s2() const override { return settings_.gravity_m_per_s2; }
  void set_gravity(const Vec3& gravity_m_per_s2) override { settings_.gravity_m_per_s2 = gravity_m_per_s2; }

  double mass_kg(VertexId v) const override { return body_.mass_kg(v); }
  double inverse_mass_per_kg(VertexId v) const override { return body_.inverse_mass()[v]; }
  double added_mass_fraction() const override { return body_.added_mass_fraction(); }
  double largest_stable_step_s() const override;
  VertexId first_bad_vertex() const override { return first_bad_vertex_; }
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const override {
    return elastic_energy_j(position_world_m) + energy_of_motion_j(position_world_m, velocity_m_per_s);
  }
  // For tests and reports, O(n): the elastic energy, and the forces that the kernels compute, fixed vertices included.
  double elastic_energy_j(std::span<const Vec4f> position_world_m) const;
  void elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const;

  // Parts of a step for the explicit driver, and the step that they may have at rest.
  int parts() const { return parts_; }
  double explicit_limit_s() const { return explicit_limit_s_; }
  // Of the last step: the largest stable part over the part taken, as the bound has it. Above 1 while explicit.
  double margin() const override { return was_implicit_ ? HUGE_VAL : margin_; }
  // implicit_steps() counts those that the explicit driver gave up.
  bool last_step_was_implicit() const { return was_implicit_; }
  std::uint64_t implicit_steps() const override { return implicit_steps_; }
  double residual_m() const override { return was_implicit_ ? residual_m_ : 0; }

  const TetRows& rows() const { return rows_; }
  const TetMesh& mesh() const override { return body_.mesh(); }

  // One step of the implicit driver with so many sweeps. For tests and comparisons.
  void implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, double step_s, int sweeps,
                     std::span<const PointConstraint> constraints = {}, std::span<Reaction> reactions = {});
  // What the implicit driver makes smaller: sum_i m_i |x_i - y_i|^2 / (2 h^2) + elastic energy.
  double objective_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> inertial_world_m,
                     double step_s) const;

 private:
  Mat3 block_n_per_m(VertexId v, std::span<const Vec4f> position_world_m, double step_s) const;
  bool explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);

  void weigh(VertexId v, const VertexStar& star, double part_s);
  TetVertex row_of(VertexId v) const;

  TetBody body_;
  VolumeMaterial material_;
  VolumeSettings settings_;
  TetDriver driver_;
  TetStiffness stiffness_;
  TetRows rows_;
  VertexStar star_;  // scratch
  double omega2_per_bound_ = 0;
  double explicit_limit_s_ = 0;
  int parts_ = 1;
  double margin_ = 0;
  bool was_implicit_ = false;
  std::uint64_t implicit_steps_ = 0;
  double residual_m_ = 0;
  VertexId first_bad_vertex_ = kNone;

  DividedConstraints constraints_;
  HeldPoints held_;
  ConstraintSupports corners_;
  std::vector<Vec4f> start_position_, start_velocity_, inertial_, last_velocity_;
  std::vector<TetBlockColumn> scratch_;  // aligned floats
};

// sum_b |K_ib| of a vertex, N/m: omega^2 <= max_i of it over m_i, for linear elements at rest and so for those with
// nodal pressures, which are softer. Rigorous; the true limit is 1.4 to 1.9 times as large a step for the former, 2 to
// 2.5 times for the latter.
double stiffness_bound_n_per_m(const VertexStar& star, const TetStiffness& stiffness);

// The largest omega^2 (1/s^2) of the solid at rest with these masses, fixed vertices (mass 0) held, by power iteration
// from a fixed start: never above the true one, a few percent below.
double largest_omega2_at_rest(const TetMesh& mesh, const TetStiffness& stiffness, std::span<const double> inverse_mass,
                              int iterations = 200);

}  // namespace sectio
